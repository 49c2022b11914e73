"""Public studies of others, flown again: `python -m gallery.studies` writes their page.

Each has its scenario, its laws, what it flies, and beside it the results of the last flight with
date and version: flights take minutes, the page is made of what is stored.
"""
