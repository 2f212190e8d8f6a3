"""What only learning needs: recordings, synthesis, training, baselines, evaluation; no run imports it."""
