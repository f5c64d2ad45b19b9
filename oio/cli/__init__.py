"""The command line: compose, build, run, refuse, sweep, print. Hydra and rich are used here and in no other package but benchmarks.

May import: `oio.results` and below. May not import: figures or benchmarks. `python -m oio.run` and `oio.recover` are its shims.
"""
