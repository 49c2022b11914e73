"""Simulations driven from outside: flights step by step, laws in plain Python, exported C."""
