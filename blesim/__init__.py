"""A Bluetooth-beacon store in software: simulate, record, position and score."""

__version__ = "0.1.0"
