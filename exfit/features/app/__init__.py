"""A page in the browser: drag a slider, see the response, fit, save."""

COMMANDS = {"app": ("start", "Drag sliders, see the response, fit, in a page.", "command:app")}
PUBLIC = {"app": "notebook:app"}
