"""The two trained stages (hands, body): features, configurations, the network and its file."""
