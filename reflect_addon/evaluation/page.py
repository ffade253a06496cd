"""The report's frame: markup and style, light and dark, on a screen and on paper."""

TEMPLATE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>Reflect report</title><style>{css}</style></head><body><main>
{body}
</main></body></html>
"""

CSS = """
:root { color-scheme: light dark; --bg: #f6f7f8; --card: #fff; --ink: #1b1f24; --soft: #5b6570; --line: #dde1e6;
  --accent: #1f6feb; --warn: #fff4d6; --warn-ink: #6b4c00; --bad: #c62828;
  --s0: #1f6feb; --s1: #d9730d; --s2: #2e9d5b; --s3: #a13fc4; --s4: #c43f5f; --s5: #0f8f9c; }
@media (prefers-color-scheme: dark) { :root { --bg: #14171a; --card: #1d2125; --ink: #e6e9ec; --soft: #98a2ad;
  --line: #333a41; --accent: #6ea8fe; --warn: #3a2f10; --warn-ink: #f3d58a; --bad: #ff7b72;
  --s0: #6ea8fe; --s1: #f0a35e; --s2: #63c98c; --s3: #cf8be6; --s4: #f08aa2; --s5: #5fc6d1; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--bg); color: var(--ink); font: 15px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; }
main { max-width: 1360px; margin: 0 auto; padding: 32px 20px 60px; }
h1 { font-size: 28px; line-height: 1.2; margin: 0 0 8px; } h2 { font-size: 20px; margin: 0 0 4px; }
h3 { font-size: 15px; margin: 0 0 6px; } h3 span { font-weight: 400; color: var(--soft); margin-left: 12px; }
.lead { max-width: 75ch; margin: 0 0 8px; } .device, .meta { color: var(--soft); margin: 0 0 10px; font-size: 14px; }
.warning { background: var(--warn); color: var(--warn-ink); border-radius: 8px; padding: 10px 14px; margin: 12px 0 0; }
section { background: var(--card); border: 1px solid var(--line); border-radius: 12px; padding: 20px; margin-top: 22px; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 4px 18px; margin: 8px 0 0; } dt { font-weight: 600; } dd { margin: 0; }
figure { margin: 0; } figcaption { color: var(--soft); font-size: 13px; margin-top: 3px; }
img { width: 100%; display: block; border-radius: 6px; background: #777; image-rendering: auto; }
.truths { display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 14px; max-width: 780px; margin-bottom: 18px; }
.method { border-top: 1px solid var(--line); padding-top: 12px; margin-top: 12px; }
.strip { display: grid; grid-template-columns: repeat(4, minmax(0, 1fr)); gap: 12px; }
.plots { display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 18px; margin: 20px 0 8px; }
.plot { width: 100%; height: auto; } .plot text { font: 11px system-ui, "DejaVu Sans", sans-serif; fill: var(--soft); }
.plot .name, .plot .label { fill: var(--ink); font-size: 12px; }
.plot .name { paint-order: stroke; stroke: var(--card); stroke-width: 4px; stroke-linejoin: round; } .plot .grid { stroke: var(--line); fill: none; }
.plot .axis { stroke: var(--soft); fill: none; } .plot .floor { stroke: var(--bad); stroke-dasharray: 5 4; fill: none; }
.plot text.floor { stroke: none; fill: var(--bad); } .plot .front { stroke: var(--accent); fill: none; stroke-width: 1.5; opacity: .55; }
.plot .best { fill: none; stroke: var(--accent); stroke-width: 1.5; }
.s0 { fill: var(--s0); } .s1 { fill: var(--s1); } .s2 { fill: var(--s2); } .s3 { fill: var(--s3); } .s4 { fill: var(--s4); } .s5 { fill: var(--s5); }
.plot .curve { fill: none; stroke-width: 1.5; } .l0 { stroke: var(--s0); } .l1 { stroke: var(--s1); } .l2 { stroke: var(--s2); } .l3 { stroke: var(--s3); } .l4 { stroke: var(--s4); } .l5 { stroke: var(--s5); }
.exhibit { display: grid; grid-template-columns: repeat(3, minmax(0, 1fr)); gap: 14px; margin-top: 14px; } .exhibit img[src^="data:image/svg"] { background: var(--card); }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; width: 100%; }
th, td { padding: 5px 6px; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap; }
tr > :first-child, .settings { text-align: left; } tr:first-child th { color: var(--soft); font-weight: 600; cursor: help; white-space: normal; vertical-align: bottom; }
td.bad { color: var(--bad); font-weight: 700; } abbr { color: var(--accent); text-decoration: none; cursor: help; }
.bench td { white-space: normal; } .bench td.settings { min-width: 9em; } .bench td:last-child.settings { min-width: 34em; }
details { margin-top: 10px; } summary { cursor: pointer; color: var(--accent); } .notes { color: var(--soft); font-size: 14px; margin: 12px 0 0; padding-left: 20px; }
.none { color: var(--soft); border: 1px dashed var(--line); border-radius: 6px; padding: 20px; text-align: center; }
.bar { display: inline-block; width: 180px; height: 12px; border-radius: 3px; margin-right: 10px; vertical-align: -1px; }
.chip { display: inline-block; width: 14px; height: 14px; border-radius: 3px; margin: 0 8px 0 0; vertical-align: -2px; }
.chip ~ .chip { margin-left: 22px; }
@media (max-width: 720px) { .strip, .plots, .truths { grid-template-columns: 1fr 1fr; } .plots { grid-template-columns: 1fr; } dl { grid-template-columns: 1fr; } }
@media print { section { break-inside: avoid; } body { background: #fff; } }
"""
