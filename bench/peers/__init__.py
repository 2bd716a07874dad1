"""One file per peer; they run in the peers' environment, see `bench/requirements.lock`."""
