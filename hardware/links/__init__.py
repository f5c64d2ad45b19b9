"""What lies between a driver and its device: a port that is found, opened alone and opened again, a clock, a bounded mailbox."""
