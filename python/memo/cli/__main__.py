"""`python -m memo.cli`."""

from memo.cli import main

main()
