"""Gas dispersion models of the simulator. They share nothing with `oio.gas.range_law`: a filter tested on its own model proves nothing.

May import: `oio.core`. May not import: any model that a filter uses.
"""
