"""The style sheet of a rater's page."""

STYLE = """
:root { color-scheme: light dark; --paper: #faf9f7; --ink: #33363a; --faint: #85888c;
  --line: #dcdad5; --mark: #2f7d5b; --on-mark: #fff; }
@media (prefers-color-scheme: dark) { :root { --paper: #1d1f22; --ink: #e6e4df; --faint: #9a9c9f;
  --line: #3a3d41; --mark: #57b98c; --on-mark: #10231a; } }
* { box-sizing: border-box; }
body { margin: 0; min-height: 100vh; background: var(--paper); color: var(--ink);
  font: 17px/1.5 system-ui, sans-serif; }
main { max-width: 1080px; margin: 0 auto; padding: 24px 20px 40px; }
h1 { font-size: 24px; font-weight: 600; margin: 0 0 14px; }
.bar { height: 5px; background: var(--line); border-radius: 3px; overflow: hidden; }
.bar div { height: 100%; width: 0; background: var(--mark); transition: width .2s; }
.count { color: var(--faint); margin: 6px 0 18px; font-variant-numeric: tabular-nums; }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: 18px; }
figure { margin: 0; }
video { display: block; width: 100%; border-radius: 8px; border: 3px solid transparent;
  background: var(--line); cursor: pointer; }
.chosen video { border-color: var(--mark); }
button { font: inherit; color: inherit; background: none; border: 1px solid var(--line);
  border-radius: 8px; padding: 10px 18px; cursor: pointer; }
button:hover, button:focus-visible { border-color: var(--mark); outline: none; }
figure button { width: 100%; margin-top: 10px; font-weight: 600; }
.chosen button, .main { background: var(--mark); border-color: var(--mark); color: var(--on-mark); }
.tools { display: flex; gap: 10px; margin-top: 22px; align-items: center; }
.tools span { color: var(--faint); margin-left: auto; font-size: 15px; }
kbd { border: 1px solid var(--line); border-radius: 4px; padding: 1px 6px; font: inherit;
  font-size: 14px; }
section[hidden] { display: none; }
p { max-width: 46em; }
"""
