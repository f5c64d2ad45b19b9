"""`python -m oio.inspect my.csv`: what is in a table of somebody's, counted, and the YAML by which `recording=csv` plays it.

May import: tabular, results' reader of plain YAML. May not import: the command line's experiments, a stage or a device.
"""
