"""Devices that speak the real wire with the simulated bench behind them: they fake the wire, never the driver."""
