"""Values and contracts that everything shares: records, settings, seeds, errors, interrupts, folders, and the interfaces of a world.

May import: numpy, beartype and the standard library. May not import: any other package of OIO.
"""
