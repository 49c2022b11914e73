"""Campaigns: many runs of one scenario, some of whose keys vary from run to run."""
