"""`python -m oio.doctor`: checks of a computer, one per file, before a run or a day in the laboratory.

May import: `oio.cli` and below. May not import: sweeps, benchmarks, devices. conf/doctor.yaml lists the checks, also those of `hardware`.
"""
