"""``python -m casadi_hands``: the command, where it is not on the path."""

from casadi_hands.cli import main

if __name__ == "__main__":
    main()
