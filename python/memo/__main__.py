"""`python -m memo` is the command `memo`, where scripts are not on the path."""

from memo.cli import main

if __name__ == "__main__":
    main()
