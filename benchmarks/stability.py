"""Shares of seeds in which Monte Carlo is wrong about itself and about the GUM.

    python benchmarks/stability.py [--seeds 200]

One input of a linear model, whose mean, standard uncertainty and 95 % interval are known: the share
of seeds in which the results are called stable; of these, in which one of the four is beyond the
tolerance (expected: 5 % or fewer), and in which the GUM's interval is validated. By `monte_carlo`
and by the fewer trials of `budget`. Noise is normal too, but a random input of the budget, of which
the first order has a few hundred draws. The ends of the GUM's interval are beyond the exact ones by
the stated part of u. No share depends on the size of u.
"""

import numpy as np
from common import arguments, print_head, print_row
from scipy import stats
from scipy.special import ndtri

from chipglow.uncertainty import Estimate, Input, Inputs, budget, monte_carlo
from chipglow.uncertainty.budget import VALIDATED

SIZES = 9.9, 10.0
PEERS = {
    "normal": stats.norm(),
    "t": stats.t(9),
    "triangular": stats.triang(0.5, -np.sqrt(6), 2 * np.sqrt(6)),
    "noise": stats.norm(),
    "rectangular": stats.uniform(-np.sqrt(3), 2 * np.sqrt(3)),
}
FREEDOMS = {"t": 9.0}


def main():
    given = arguments(__doc__, seeds=200)
    print_head("input", "u", "GUM beyond / u", "trials", "stable", "beyond", "validated")
    for name, peer in PEERS.items():
        for size in SIZES:
            for which in (by_budget,) if name == "noise" else (by_monte_carlo, by_budget):
                found = [which(name, size, seed) for seed in range(given.seeds)]
                stable = [one for one in found if one[0].is_stable.all()]
                shares = (
                    len(stable) / len(found),
                    np.mean([is_beyond(one, size, peer) for one, _ in stable]),
                    np.mean([is_valid for _, is_valid in stable]),
                )
                trials = np.mean([one.trials for one, _ in found])
                texts = (f"{100 * share:.1f} %" for share in shares)
                apart = stats.t(FREEDOMS.get(name, np.inf)).ppf(0.975) - peer.ppf(0.975)
                print_row(name, f"{size:g}", f"{apart:.3f}", f"{trials:.0f}", *texts)


def by_monte_carlo(name, size, seed):
    """Return the distribution of an estimate, and whether it validates the estimate."""
    distribution = "normal" if name == "t" else name
    one = Estimate(0.0).with_component(
        "x", size, distribution=distribution, degrees_of_freedom=FREEDOMS.get(name, np.inf)
    )
    found = monte_carlo(lambda x: x, one, generator=np.random.default_rng(seed))
    return found, bool(found.validates(one))


def by_budget(name, size, seed):
    """Return the distribution in a budget, and whether it validates the first order."""
    distribution = "normal" if name == "t" else name
    freedom = FREEDOMS.get(name, np.inf)
    one = Input("x") if name == "noise" else Input("x", 0.0, size, distribution, freedom)

    def model(rows):
        return size * ndtri(rows * 1e6 % 1) if name == "noise" else rows

    found = budget(model, Inputs([one]), np.random.default_rng(seed), samples=2)
    return found.monte_carlo, bool(found.monte_carlo.validates(found.estimate, VALIDATED)[0])


def is_beyond(found, size, peer):
    """Return whether a result differs by more than the tolerance from the exact one."""
    low, high = peer.ppf([0.025, 0.975])
    exact = np.array([0.0, peer.std(), low, high]) * size
    tolerance = found.tolerance * size * (high - low) / (2 * stats.norm.ppf(0.975))
    results = found.mean, found.standard_uncertainty, found.low, found.high
    return bool((np.abs(np.ravel(results) - exact) > tolerance).any())


if __name__ == "__main__":
    main()
