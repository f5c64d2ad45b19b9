"""The Python interface: what `import oio` offers to other programs, arrays in and out. Hydra composes the numbers of conf/ underneath.

May import: every other room of `oio` but benchmarks. May not import: `pipelines` or `hardware`; no room may import this one.
"""
