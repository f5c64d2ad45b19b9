"""The report of a run or a sweep: one self-contained HTML file that says whether to trust a calibration, why, and what to do next.

`material` reads what a run left behind; each `*_part` makes one part of the page; `page` joins them; `drawing` draws to SVG and PNG.
May import: `oio.sweep`, `oio.figures` and below. May not import: benchmarks, a stage or a device.
"""
