"""Systems for what runs services elsewhere: units, Compose files, manifests."""
