"""`python -m torquer`: the command line."""

from torquer.cli import main

main()
