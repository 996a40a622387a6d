"""What a recording is, in words: when, of what, by which version, and whether it is whole."""

from datetime import UTC, datetime

from app.record.recording import Recording


def facts(recording: Recording) -> list[tuple[str, str]]:
    """Names and words, for a table."""
    head, times = recording.head, recording.times
    setup, seconds = head.setup, float(times[-1] - times[0])
    versions = dict(head.fingerprint.versions)
    rows = [
        ("recorded", datetime.fromtimestamp(head.began, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")),
        ("length", f"{seconds:.2f} s, {len(recording)} ticks at {head.rate:g} Hz"),
        ("robot", setup.urdf or setup.robot),
        ("skin", str(setup.skin or "the robot's own")),
        ("cell", setup.cell or "the scene's"),
        ("scene", head.scene),
        ("frames", head.source),
        ("arm", setup.driver),
        ("begins", f"at tick {head.first_tick}" if head.state else "with the run"),
        ("Flinch", head.flinch),
        ("packages", ", ".join(f"{n} {versions[n]}" for n in sorted(versions) if n != "flinch")),
        ("processor", head.fingerprint.processor),
    ]
    if recording.dropped:
        rows.append(("missing", f"{recording.dropped} ticks found no room while it was recorded"))
    if recording.torn:
        rows.append(("ends early", recording.torn))
    return rows
