"""The science: body, encodings, diffusion, contact, data, training. It knows no phones or pixels."""
