"""The dashboard's answers: a pure function of the controller and a line."""

from app.virtual.ur.controller import MODEL, UrController

GREETING = "Connected: Universal Robots Dashboard Server"
E_SERIES = 5  # major version of the first that have a remote control
_MODES = {3: "POWER_OFF", 5: "IDLE", 7: "RUNNING"}
_SAFETY = {1: "NORMAL", 2: "REDUCED", 3: "PROTECTIVE_STOP", 7: "ROBOT_EMERGENCY_STOP"}


def answer(controller: UrController, line: str) -> str:
    """What the dashboard says to a line; some lines act on the controller."""
    playing = controller.playing
    match line.strip().lower():
        case "polyscopeversion":
            return "URSoftware " + ".".join(map(str, controller.version)) + " (virtual)"
        case "version":
            return ".".join(map(str, controller.version))
        case "get serial number":
            return "20230000000"
        case "get robot model":
            return MODEL
        case "is in remote control" if controller.version[0] >= E_SERIES:
            return str(controller.remote).lower()
        case "robotmode":
            return f"Robotmode: {_MODES[controller.robot_mode]}"
        case "safetymode":
            return f"Safetymode: {_SAFETY[controller.safety_mode]}"
        case "safetystatus":
            return f"Safetystatus: {_SAFETY[controller.safety_mode]}"
        case "running":
            return f"Program running: {str(playing).lower()}"
        case "programstate":
            return f"{'PLAYING' if playing else 'STOPPED'} rtde_control.urp"
        case "stop":
            controller.end_program("stopped from the dashboard")
            return "Stopped"
        case "unlock protective stop":
            if controller.safety_mode != 3:
                return "Cannot unlock protective stop: there is none"
            controller.unlock()
            return "Protective stop releasing"
        case "close safety popup":
            return "closing safety popup"
        case "close popup":
            return "closing popup"
        case "quit":
            return "Disconnected"
        case text if text.startswith("popup "):
            return "showing popup"
        case text:
            return f"could not understand: '{text[:80]}'"
