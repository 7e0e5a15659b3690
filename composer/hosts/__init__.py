"""Systems on other hosts: what each is brought over SSH, and how all of them change together."""
