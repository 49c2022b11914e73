"""Flight and bench data: reading telemetry of unknown quality, its checks, its calibration."""
