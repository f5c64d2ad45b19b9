"""Commands of the program by name, with the module that `python -m` runs and one sentence; read by `oio` and by tab completion."""

COMMANDS = {
    "run": ("oio.run", "calibrate and search, once or as a sweep (-m): `oio sensor=ec dof=5` is short for it"),
    "sweep": ("oio.sweep", "sweeps: status, resume, table, compare, worst"),
    "report": ("oio.report", "one HTML file of a run or a sweep: whether to trust it, why, what to do next"),
    "figures": ("oio.figures", "a picture of a run"),
    "view": ("oio.view", "a run in the Rerun viewer, from its log"),
    "compare": ("oio.compare", "what changed between calibrations, in standard deviations"),
    "export": ("oio.export", "a run as TUM, CSV, Parquet, Kalibr or robot_localization files"),
    "inspect": ("oio.inspect", "what is in a CSV or Parquet file, and the YAML to play it"),
    "localise": ("oio.localise", "where the source is, from the log of a nose that was moved"),
    "identify": ("oio.identify", "noise, drift, lags and twins of a sensor, from its readings"),
    "reproduce": ("oio.reproduce", "make a run again from its own log, and compare to the bit"),
    "recover": ("oio.recover", "a finished log from one that was cut off or damaged"),
    "protocol": ("oio.protocol", "a protocol of the laboratory as a page to print"),
    "doctor": ("oio.doctor", "is this computer ready?"),
    "bench": ("oio.bench", "accuracy, drift, filters and worlds over many seeds"),
    "ports": ("hardware.ports", "which device answers at which serial port"),
    "home": ("hardware.home", "zeros and directions of an arm's servos"),
    "joints": ("hardware.joints", "what an arm that another program commands says of its joints"),
    "emulate": ("hardware.emulate", "devices that speak the real frames, with a simulated bench behind them"),
}
