"""`python -m composer`."""

from composer.cli.main import main

if __name__ == '__main__':
    main()
