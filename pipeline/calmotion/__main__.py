"""`python -m calmotion`."""

import sys

from calmotion.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
