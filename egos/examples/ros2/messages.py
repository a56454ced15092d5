"""The road, the views and the command as ROS 2 messages.

The frame `map` is that of the net. The origin of `base_link` is the middle of the rear axle, with x ahead and y to the
left. Units are those of ROS: m, s, rad. Stamps are ROS time in nanoseconds.
"""

import math
from itertools import accumulate, pairwise

from geometry_msgs.msg import Point, Point32, PolygonStamped, Pose, PoseStamped
from nav_msgs.msg import Odometry, Path
from planning import SPACING_M, speeds_on
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

MAP, BASE_LINK = "map", "base_link"
VELOCITY, STOP_LINE = "velocity", "stop_line"  # namespaces of markers; the others are kinds of road users
NS = 1_000_000_000


def header(stamp_ns, frame=MAP):
    made = Header(frame_id=frame)
    made.stamp.sec, made.stamp.nanosec = divmod(stamp_ns, NS)
    return made


def pose(x, y, heading):
    made = Pose()
    made.position.x, made.position.y = x, y
    made.orientation.z, made.orientation.w = math.sin(0.5 * heading), math.cos(0.5 * heading)
    return made


def travel_times(road):
    """The time at each point of the route's line of a car that drives at the speed limits, in s."""
    ways = zip(pairwise(road["route_line"]), speeds_on(road, math.inf), strict=False)
    return [0.0, *accumulate(math.dist(*ends) / limit for ends, limit in ways)]


def route(line, times, share, stamp_ns):
    """The route. A pose is stamped with the time at which a car that drives at the speed limits is there."""
    path = Path(header=header(stamp_ns))
    for k, ((x, y), time) in enumerate(zip(line, times, strict=True)):
        (ax, ay), (bx, by) = line[max(k - 1, 0)], line[min(k + 1, len(line) - 1)]
        at = header(stamp_ns + round(time / share * NS))
        path.poses.append(PoseStamped(header=at, pose=pose(x, y, math.atan2(by - ay, bx - ax))))
    return path


def lines(road):
    """The centre lines of the lanes, and the rails."""
    named = [("lane", each["line"]) for each in road["lanes"].values()] + [("rail", each) for each in road["rails"]]
    return MarkerArray(markers=[_line(space, number, line) for number, (space, line) in enumerate(named)])


def _line(space, number, line):
    made = Marker(header=header(0), ns=space, id=number, type=Marker.LINE_STRIP)
    made.points = [Point(x=x, y=y) for x, y in line]
    made.pose.orientation.w, made.scale.x = 1.0, 0.1
    made.color = ColorRGBA(r=0.5, g=0.5, b=0.5, a=1.0)
    return made


def footprint(limits):
    """The corners of the car."""
    made, front = PolygonStamped(header=header(0, BASE_LINK)), 0.5 * limits["wheelbase_m"]
    for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
        corner = front + 0.5 * x * limits["length_m"], 0.5 * y * limits["width_m"]
        made.polygon.points.append(Point32(x=corner[0], y=corner[1]))
    return made


def odometry(view, limits, stamp_ns):
    made = Odometry(header=header(stamp_ns), child_frame_id=BASE_LINK)
    wheelbase, heading = limits["wheelbase_m"], view["heading_rad"]
    x, y = view["x_m"] - 0.5 * wheelbase * math.cos(heading), view["y_m"] - 0.5 * wheelbase * math.sin(heading)
    made.pose.pose = pose(x, y, heading)
    speed = view["speed_mps"] * _axle_share(view["steering_rad"])
    made.twist.twist.linear.x = speed
    made.twist.twist.angular.z = speed * math.tan(view["steering_rad"]) / wheelbase
    return made


def objects(view, road, limits, stamp_ns):
    """What the car sees: a cube for each object, in the namespace of its kind, and an arrow of the same id to where it
    is in a second; and a cube at each stop line ahead whose signal is yellow or red. The first marker deletes those of
    the message before."""
    found = [Marker(header=header(stamp_ns), action=Marker.DELETEALL)]
    for each in view["objects"]:
        at, (vx, vy) = (each["x_m"], each["y_m"]), (each["velocity_x_mps"], each["velocity_y_mps"])
        size = each["length_m"], each["width_m"]
        found.append(_cube(each["kind"], each["id"], (*at, each["heading_rad"]), size, stamp_ns))
        arrow = Marker(header=header(stamp_ns), ns=VELOCITY, id=each["id"], type=Marker.ARROW)
        arrow.points = [Point(x=at[0], y=at[1]), Point(x=at[0] + vx, y=at[1] + vy)]
        arrow.pose.orientation.w, arrow.scale.x, arrow.scale.y = 1.0, 0.2, 0.5
        arrow.color = ColorRGBA(r=1.0, g=0.5, a=1.0)
        found.append(arrow)
    front_m = view["station_m"] + 0.5 * limits["length_m"]
    for number, (signal, now) in enumerate(zip(road["signals"], view["signals"], strict=True)):
        if now["state"] in ("yellow", "red") and signal["station_m"] > front_m:
            k = min(round(signal["station_m"] / SPACING_M), len(road["route_line"]) - 2)
            (ax, ay), (bx, by) = road["route_line"][k : k + 2]
            at = ax, ay, math.atan2(by - ay, bx - ax)
            found.append(_cube(STOP_LINE, number, at, (0.1, 3.0), stamp_ns))
    return MarkerArray(markers=found)


def _cube(space, number, at, size, stamp_ns):
    made = Marker(header=header(stamp_ns), ns=space, id=number, type=Marker.CUBE, pose=pose(*at))
    made.scale.x, made.scale.y, made.scale.z = *size, 1.5
    made.color = ColorRGBA(r=1.0, g=0.5, a=0.8)
    return made


def decision(twist, view, limits, step_s):
    """Acceleration and road wheel angle that a command asks for: its speed after the step, and its yaw rate. A car that
    stops keeps its road wheel angle."""
    speed, steering = twist.linear.x, view["steering_rad"]
    if speed > 0.0:
        steering = math.atan(twist.angular.z * limits["wheelbase_m"] / speed)
    return [(speed / _axle_share(steering) - view["speed_mps"]) / step_s, steering]


def _axle_share(steering):
    """The speed of the rear axle as a share of that of the car's centre."""
    return math.cos(math.atan(0.5 * math.tan(steering)))
