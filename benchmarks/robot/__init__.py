"""One model file beside MuJoCo: workers of robots.py, and what they measure."""
