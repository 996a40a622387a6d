"""The times that frames of a simulated skin arrive with: not quite those of the light."""

from dataclasses import replace

from app.messages import SensorFrame
from app.sensing.truth import Truth
from app.sensing.truth_parts import Part, stream


class Stamps:
    """Frames come `delay` [s] after they were measured, stamped as late as the truth says."""

    def __init__(self, truth: Truth, latency: float) -> None:
        """latency: [s] until a frame arrives, longer where its stamp could not be known yet."""
        self.delay = max(latency, truth.late)
        self._late, self._jitter = truth.late, truth.jitter
        self._rng = [stream(truth.seed, Part.TIME, k) for k in range(truth.skin.count)]

    def stamped(self, frame: SensorFrame) -> SensorFrame:
        """The sensor's next frame, whose stamp is that of its light, as it arrives.

        Nothing is stamped later than it arrives.
        """
        if not (self._late or self._jitter):
            return frame
        error = self._late + self._jitter * self._rng[frame.sensor].standard_normal()
        return replace(frame, stamp=frame.stamp + min(float(error), self.delay))
