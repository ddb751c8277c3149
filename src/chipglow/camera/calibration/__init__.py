"""From counts to radiance: calibrations and their fit to blackbodies."""
