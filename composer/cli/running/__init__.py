"""The commands that ask systems which run: `ps`, `top`, `reload`, `restart`, `down`, `logs`."""
