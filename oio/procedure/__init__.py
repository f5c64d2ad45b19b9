"""Protocols for a laboratory: what a person does before, between and after stages, is asked, and waits for; all of it in the log.

May import: `oio.runtime` and below. May not import: the command line, estimation, a stage or a device.
"""
