"""Pictures of a run, drawn from its log alone: `python -m oio.figures RUN_DIR`."""
