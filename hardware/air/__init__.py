"""The simulator's gas. It shares no code and no number with `oio.ranging`: a filter tested on its own model proves nothing."""
