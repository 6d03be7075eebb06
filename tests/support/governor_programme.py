"""A programme of a governor: a slow record for its droop, and points of its gate over the power."""

PROGRAMME = """\
model: SEXS
plant: {type: infinite-bus, machine: GENSAL, network: {f0: 60, X: 0.25, P: 0.6, E: 1.0}}
governor: {model: HYGOV, parameters: {Tf: 0.05, Tg: 0.25}}
parameters: {fixed: {TATB: 1.0, TB: 0.0}}
tests:
  - name: slow
    kind: governor
    file: slow.csv
    columns:
      time: t
      speed: {column: f (Hz), unit: Hz, base: 60}
      gate: {column: Y (%), unit: "%", base: 100}
    free:
      R: {start: 0.05, min: 0.01, max: 0.3}
      DBH: {start: 0.0003, min: 0.0, max: 0.005, scale: linear}
      DBL: {start: -0.0003, min: -0.005, max: 0.0, scale: linear}
  - name: gate
    kind: governor
    file: gate.csv
    columns: {p: P, gate: Y}
    free:
      At: {start: 1.0, min: 0.5, max: 2.0}
      qNL: {start: 0.05, min: 0.0, max: 0.3, scale: linear}
"""
