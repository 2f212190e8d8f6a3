"""The methods of the tables, each with the one interface of `omomo_core.learning.evaluation.method`."""
