"""NoDL, the Node Definition Language: documents that say what the nodes of a package have."""
