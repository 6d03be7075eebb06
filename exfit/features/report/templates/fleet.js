"use strict";
// The table of cases can be sorted by its columns, searched and filtered. Only rows that are shown
// lie in the page: to lay out thousands takes long.
(() => {
  const body = document.querySelector("#table tbody");
  const AT_ONCE = 100;
  const rows = [...body.rows].map((row) => ({row, text: null}));
  let ordered = rows, matching = rows, most = AT_ONCE;
  const heads = [...document.querySelectorAll("#table thead th")];
  const field = (id) => document.getElementById(id);
  const filters = {o: field("outcome"), s: field("status"), m: field("model")};
  const words = new Intl.Collator("en", {numeric: true, sensitivity: "base"});
  const form = field("controls"), sort = field("sort");

  function matches(entry, terms) {
    for (const [key, select] of Object.entries(filters)) {
      if (select.value && entry.row.dataset[key] !== select.value) return false;
    }
    if (!terms.length) return true;
    entry.text ??= entry.row.textContent.toLowerCase();
    return terms.every((term) => entry.text.includes(term));
  }

  function show(count = most) {
    body.replaceChildren(...matching.slice(0, count).map((entry) => entry.row));
    const left = matching.length - most;
    field("more").hidden = left <= 0;
    field("more").textContent = `Show ${Math.min(left, AT_ONCE)} more of ${left}`;
    field("shown").textContent = `${matching.length} of ${rows.length} cases`;
  }

  function filter() {
    const terms = field("search").value.toLowerCase().split(/\s+/).filter(Boolean);
    matching = ordered.filter((entry) => matches(entry, terms));
    most = AT_ONCE;
    show();
  }

  // a number in data-v comes before text; what is missing comes last in both directions
  function key(entry, column) {
    const cell = entry.row.cells[column], value = cell.dataset.v;
    return value === undefined ? cell.textContent : value === "" ? null : Number(value);
  }

  function order(column, descending) {
    const sign = descending ? -1 : 1;
    const keyed = rows.map((entry) => [key(entry, column), entry]);
    keyed.sort(([a], [b]) => {
      if (a === null || b === null) return (a === null) - (b === null);
      return sign * (typeof a === "number" ? a - b : words.compare(a, b));
    });
    ordered = keyed.map(([, entry]) => entry);
    heads.forEach((head, k) => {
      if (!head.classList.contains("fixed")) {
        head.setAttribute("aria-sort", k !== column ? "none" : descending ? "descending" : "ascending");
      }
    });
    sort.value = `${column} ${descending ? 1 : 0}`;
    filter();
  }

  heads.forEach((head, column) => {
    if (head.classList.contains("fixed")) return;
    const name = head.textContent, button = document.createElement("button");
    button.type = "button";
    button.textContent = name;
    button.addEventListener("click", () => order(column, head.getAttribute("aria-sort") === "ascending"));
    head.replaceChildren(button);
    for (const [down, words] of [[0, "upward"], [1, "downward"]]) {
      sort.add(new Option(`${name}, ${words}`, `${column} ${down}`));
    }
  });
  sort.addEventListener("change", () => {
    const [column, down] = sort.value.split(" ").map(Number);
    order(column, down === 1);
  });
  let waiting = 0;
  form.addEventListener("input", () => {
    clearTimeout(waiting);
    waiting = setTimeout(filter, 120);
  });
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("reset", () => setTimeout(() => order(0, false)));
  field("more").addEventListener("click", () => {
    const first = matching[most];
    most += AT_ONCE;
    show();
    first.row.cells[0].querySelector("a")?.focus();
  });
  window.addEventListener("beforeprint", () => show(matching.length));
  window.addEventListener("afterprint", () => show());
  form.hidden = false;
  order(0, false);
  document.documentElement.classList.remove("loading");
  document.documentElement.dataset.ready = "true";
})();
