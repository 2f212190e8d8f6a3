"""The page's style sheet: system fonts, light or dark as the reader's device is, narrow or wide."""

STYLE = """
:root { color-scheme: light dark;
  --paper:#fbfaf8; --card:#ffffff; --ink:#1c1d21; --quiet:#6a6c75; --hair:#e4e2dd; --grid:#eeece7;
  --ok:#1d7a4c; --ok-soft:#e5f3ea; --warn:#9a6200; --warn-soft:#fdf0d5; --bad:#b3261e;
  --bad-soft:#fbe4e1; --one:#2b5fd0; --two:#c2571a; --rest:#dcebe0; }
@media (prefers-color-scheme: dark) { :root {
  --paper:#131417; --card:#1b1d21; --ink:#ececee; --quiet:#9c9fa9; --hair:#2c2f35; --grid:#25282d;
  --ok:#6cce97; --ok-soft:#1b3427; --warn:#f0b955; --warn-soft:#3a2d12; --bad:#ff8f85;
  --bad-soft:#44201d; --one:#82a7ff; --two:#ff9f68; --rest:#213328; } }
* { box-sizing:border-box; }
body { margin:0; background:var(--paper); color:var(--ink); -webkit-text-size-adjust:100%;
  font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",sans-serif; }
main { max-width:58rem; margin:0 auto; padding:2.5rem 1.25rem 4rem; }
header p { margin:0; color:var(--quiet); font-size:.9rem; overflow-wrap:anywhere; }
h1 { margin:.2rem 0 0; font-size:1.05rem; font-weight:600; overflow-wrap:anywhere; }
h2 { margin:2.75rem 0 .9rem; font-size:1.15rem; font-weight:650; letter-spacing:-.01em; }
h3 { margin:0 0 .5rem; font-size:.95rem; font-weight:600; }
.verdict { margin:1.4rem 0 0; padding:1.25rem 1.4rem; border-radius:14px; }
.verdict strong { display:block; font-size:1.6rem; line-height:1.25; letter-spacing:-.02em; }
.verdict p { margin:.45rem 0 0; max-width:44rem; color:var(--ink); }
.verdict.ok { background:var(--ok-soft); } .verdict.ok strong { color:var(--ok); }
.verdict.warn { background:var(--warn-soft); } .verdict.warn strong { color:var(--warn); }
.verdict.bad { background:var(--bad-soft); } .verdict.bad strong { color:var(--bad); }
.facts { display:grid; grid-template-columns:repeat(auto-fit,minmax(8.5rem,1fr)); gap:.75rem;
  margin:1.25rem 0 0; padding:0; }
.facts div { padding:.7rem .9rem; background:var(--card); border:1px solid var(--hair);
  border-radius:12px; }
.facts dt { color:var(--quiet); font-size:.78rem; }
.facts dd { margin:0; font-size:1.2rem; font-weight:600; font-variant-numeric:tabular-nums; }
.checks { list-style:none; margin:0; padding:0; background:var(--card); overflow:hidden;
  border:1px solid var(--hair); border-radius:14px; }
.checks li { display:grid; grid-template-columns:6.2rem 11rem 1fr; gap:.15rem 1rem;
  padding:.7rem 1.1rem; }
.checks li + li { border-top:1px solid var(--hair); }
details { margin-top:.8rem; }
summary { cursor:pointer; padding:.3rem .2rem; color:var(--ok); font-weight:600; font-size:.92rem; }
details[open] summary { margin-bottom:.5rem; }
.name { font-weight:600; }
.what { overflow-wrap:anywhere; }
.where { color:var(--quiet); white-space:nowrap; font-size:.88rem; }
.fix { display:block; margin-top:.2rem; }
.fix b { font-weight:600; }
.badge { justify-self:start; align-self:start; padding:.1rem .6rem .12rem; border-radius:99px;
  font-size:.82rem; font-weight:600; white-space:nowrap; }
.badge.ok { background:var(--ok-soft); color:var(--ok); }
.badge.warn { background:var(--warn-soft); color:var(--warn); }
.badge.bad { background:var(--bad-soft); color:var(--bad); }
figure { margin:0 0 1.1rem; padding:1rem 1.1rem .6rem; background:var(--card);
  border:1px solid var(--hair); border-radius:14px; }
svg { display:block; width:100%; height:auto; }
.legend { display:flex; flex-wrap:wrap; gap:.2rem 1.1rem; margin:0 0 .4rem; color:var(--quiet);
  font-size:.84rem; }
.legend i { display:inline-block; width:1.1rem; height:.24rem; margin-right:.4rem;
  vertical-align:middle; border-radius:2px; background:var(--one); }
.legend i.two { background:var(--two); }
.legend i.rest { height:.8rem; background:var(--rest); }
.legend i.fault { height:.8rem; background:var(--bad); opacity:.35; }
text { font-family:inherit; fill:var(--quiet); font-size:12.5px;
  font-variant-numeric:tabular-nums; }
text.label { fill:var(--ink); }
.grid { stroke:var(--grid); } .axis, .tick { stroke:var(--quiet); fill:none; }
.line { fill:none; stroke:var(--one); stroke-width:1.7; stroke-linejoin:round; }
.line.two { stroke:var(--two); }
.dot { fill:var(--card); stroke:var(--one); stroke-width:2.2; }
rect.rest { fill:var(--rest); } rect.fault { fill:var(--bad); opacity:.35; }
footer { margin-top:2.5rem; color:var(--quiet); font-size:.85rem; }
@media (max-width:40rem) {
  main { padding:1.5rem .9rem 3rem; }
  .checks li { grid-template-columns:auto 1fr; padding:.8rem .9rem; }
  .checks .what { grid-column:1 / -1; }
  figure { padding:.8rem .6rem .4rem; }
  text { font-size:19px; } .number { font-size:17px; }
  .line { stroke-width:2.6; }
}
@media print { body { background:#fff; } figure, .checks li { break-inside:avoid; } }
"""
