"""What settings were once called, for whoever comes with an old file or an old command line."""

NOW = {
    "d_s": "distance_kept",
    "d_inf": "avoidance_begins",
    "v_esc": "retreat_speed",
    "slide": "slide_along",
    "escape": "way_round",
    "lexicographic": "bounds_first",
    "limit_task": "limits_first",
    "goal_split": "position_first",
    "v_max": "goal_speed",
    "w_max": "goal_turning",
    "speed": "joint_speed",
    "ssm_person": "person_speed",
    "ssm_measured": "person_speed_measured",
    "ssm_reaction": "reaction_time",
    "ssm_deceleration": "braking",
    "ssm_margin": "separation_margin",
}
ELSEWHERE = {
    "d_min": "give distance_kept, which is 0.05 m more",
    "slow_after": "give silence: the arm slows from 0.4 of it on",
    "two_sided": "choose mode = 'paper'",
    "footprint": "choose mode = 'paper'",
    "ghost_filter": "choose mode = 'paper'",
    "authority_cap": "choose mode = 'paper'",
} | dict.fromkeys(
    ("range_min", "range_max", "near_cut", "frame_age", "accept_merged", "accept_unconfirmed"),
    "it is a fact of the sensor's type now, in static_assets/sensors",
) | dict.fromkeys(
    ("eps_min", "eps_base", "eps_sigmas"),
    "the robot's eps_m and eps_edge_m hold what `flinch calibrate filter` finds",
)  # fmt: skip
CONSTANT = {
    "delta", "lambda_safety", "v_safe", "lambda_p", "lambda_o", "kappa", "v_ach_min", "lambda_r",
    "theta", "eta", "ghost_near", "pair_hold", "many_pairs", "xi", "k_g", "k_b",
}  # fmt: skip


def moved(name: str) -> str:
    """What to write instead of a name of before; empty for one that never was."""
    if name in NOW:
        return f"it is called {NOW[name]} now"
    if name in CONSTANT:
        return "it is a constant of the method now; leave it out"
    return ELSEWHERE.get(name, "")
