"""The tables that report.py and measurements.py put into documents."""
