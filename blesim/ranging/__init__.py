"""What RSSI tells: smoothed signal values and, built on them, ranges and fingerprint positions."""
