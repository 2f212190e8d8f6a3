"""The science: body, object features, diffusion, contact, data, training. It knows no phones and no pixels."""
