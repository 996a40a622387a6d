"""The page's colours, RGB, 0..255; those that other viewers show too come from `app.colours`."""

from app.colours import ALARM as ALARM
from app.colours import CALM as CALM
from app.colours import GREY as GREY
from app.colours import KNOWN as KNOWN
from app.colours import POINT as POINT
from app.colours import REMEMBERED as REMEMBERED
from app.colours import RGB as RGB
from app.colours import WARN as WARN
from app.colours import css as css
from app.messages import SensorHealth

# of buttons: white on each is read easily, from 5.3 : 1
DANGER: RGB = (201, 42, 42)
GO: RGB = (35, 120, 70)
WAIT: RGB = (52, 92, 160)
QUIET: RGB = (92, 100, 110)

NEAR: RGB = (70, 80, 190)  # the avoidance acts, and what is promised is kept
FIXED: RGB = (120, 125, 132)  # what cannot give way
DARK: RGB = (60, 66, 74)
GHOST: RGB = (120, 90, 200)

HEALTH: dict[SensorHealth, RGB] = {
    SensorHealth.ABSENT: (150, 155, 160),
    SensorHealth.WAITING: (86, 140, 220),
    SensorHealth.GOOD: CALM,
    SensorHealth.POOR: WARN,
    SensorHealth.STALE: ALARM,
    SensorHealth.FROZEN: (170, 80, 170),
    SensorHealth.SATURATED: (120, 94, 60),
    SensorHealth.SLOW: (222, 203, 80),
}

CHOSEN: RGB = (32, 100, 170)  # what a person has clicked: the page's own blue
# of the legend, where the thing has no one colour of its own
ARM: RGB = (196, 202, 210)
BODY: RGB = (122, 99, 184)
GOAL: RGB = (240, 200, 40)

PREVIEW: RGB = (240, 160, 40)  # cubes that a person has not kept yet
RAW: RGB = (70, 75, 82)
