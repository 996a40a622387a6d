"""Names as a person would say them."""


def link_words(link: str) -> str:
    """`upper_arm_link` as `upper arm`."""
    words = [w for w in link.split("_") if w not in ("link", "inertia")]
    return " ".join(words) or link
