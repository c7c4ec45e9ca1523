"""Prints every sample of a file of metrics, with its type, as Prometheus' own client for Python reads it."""

import sys

from prometheus_client.parser import text_fd_to_metric_families

with open(sys.argv[1], encoding="utf-8") as file:
    for family in text_fd_to_metric_families(file):
        assert family.documentation and family.type in ("counter", "gauge"), family
        for sample in family.samples:
            labels = ",".join(f"{key}={value}" for key, value in sorted(sample.labels.items()))
            print(family.type, f"{sample.name}{{{labels}}}", sample.value)
