"""Definitions of the commonest ROS 2 messages: a .db3 bag older than ROS 2 Iron holds none.

From ros2/common_interfaces, branch humble, without comments; where a bag holds a definition, that one is taken.
"""

from __future__ import annotations

_RULE = "\n" + "=" * 80 + "\n"
_HEADER = _RULE + "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id"
_LAYOUT = (
    f"{_RULE}MSG: std_msgs/MultiArrayLayout\nstd_msgs/MultiArrayDimension[] dim\nuint32 data_offset"
    f"{_RULE}MSG: std_msgs/MultiArrayDimension\nstring label\nuint32 size\nuint32 stride"
)
_WRENCH = (
    f"{_RULE}MSG: geometry_msgs/Wrench\ngeometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque"
    f"{_RULE}MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z"
)
DEFINITIONS = {
    "sensor_msgs/msg/JointState": "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
    f"float64[] effort{_HEADER}",
    "std_msgs/msg/Float32": "float32 data",
    "std_msgs/msg/Float64": "float64 data",
    "std_msgs/msg/Float64MultiArray": f"std_msgs/MultiArrayLayout layout\nfloat64[] data{_LAYOUT}",
    "geometry_msgs/msg/WrenchStamped": f"std_msgs/Header header\ngeometry_msgs/Wrench wrench{_HEADER}{_WRENCH}",
}
