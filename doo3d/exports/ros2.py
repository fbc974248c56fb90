"""Export a ROS 2 bag: the chains as paths, and as markers for RViz."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from ..errors import require
from ..types import Array, Chain, Detection, Floats
from .base import RadiusExport, colors, labels, times
from .link_frames import link_frames

NS_PER_S = 1_000_000_000
ADD, DELETE_ALL, LINE_LIST, SPHERE_LIST = 0, 3, 5, 7  # of visualization_msgs/Marker
Z_TO_X = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])  # a link frame has z along the segment, a pose has x


class Ros2(RadiusExport):
    """Export format ROS 2 bag: for each frame, a nav_msgs/Path per chain and a visualization_msgs/MarkerArray of all chains.

    The topics are /doo3d/chain0 for the chain with the number 0, and so on, and /doo3d/markers. Junctions are white spheres among
    the markers, in the namespace "junctions".
    """

    summary: ClassVar[str] = "ROS 2 bag: nav_msgs/Path per chain, visualization_msgs/MarkerArray"
    suffixes: ClassVar[tuple[str, ...]] = ()
    file_per: ClassVar[Any] = "capture"

    storage: Literal["mcap", "sqlite3"] = Field("mcap", description="storage of the bag")
    frame_id: str | None = Field(None, description="frame_id of the headers; default: camera in camera coordinates, else map")
    rate: float = Field(30.0, gt=0, description="frames per second of a capture without timestamps")

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write all frames as a bag: the folder `path`, with the data and metadata.yaml.

        The time of a message is the frame's timestamp. If any frame has none, the times are 0, 1 / rate, 2 / rate, ... s, with
        the option `rate`.

        Raises
        ------
        InputError
            the radius of a chain is unknown and the option `radius` is not set.
        MissingDependency
            the package rosbags is not installed.
        """
        bags, stores = require("rosbags.rosbag2", "bags"), require("rosbags.typesys", "bags")
        store = stores.get_typestore(stores.Stores.ROS2_HUMBLE)
        storage = {"mcap": bags.StoragePlugin.MCAP, "sqlite3": bags.StoragePlugin.SQLITE3}[self.storage]
        with bags.Writer(path, version=9, storage_plugin=storage) as bag:
            topics: dict[str, Any] = {}
            for frame, seconds in zip(frames, times(frames, self.rate), strict=True):
                stamp = round(seconds * NS_PER_S)
                for topic, message in self._messages(store.types, frame, stamp):
                    if topic not in topics:
                        topics[topic] = bag.add_connection(topic, message.__msgtype__, typestore=store)
                    bag.write(topics[topic], stamp, store.serialize_cdr(message, message.__msgtype__))

    def _messages(self, types: Any, frame: Detection, stamp: int) -> Iterator[tuple[str, Any]]:
        name = self.frame_id or ("camera" if frame.coordinates == "camera" else "map")
        time = types["builtin_interfaces/msg/Time"](sec=stamp // NS_PER_S, nanosec=stamp % NS_PER_S)
        header = types["std_msgs/msg/Header"](stamp=time, frame_id=name)
        make = _MessageFactory(types, header)
        markers = [make.marker(0, DELETE_ALL, "", 0.0, (0, 0, 0), np.zeros((0, 3)))]
        for label, chain in zip(labels(frame), frame.chains, strict=True):
            yield f"/doo3d/chain{label}", make.path(chain)
            for occluded, color in enumerate(colors(label)):
                pairs = np.stack((chain.joints[:-1], chain.joints[1:]), axis=1)[chain.occluded == bool(occluded)].reshape(-1, 3)
                if len(pairs):
                    namespace = "occluded" if occluded else "seen"
                    markers.append(make.marker(label, ADD, namespace, 2 * self.radius_of(chain), color, pairs))
        for number, junction in enumerate(frame.junctions):
            width = 2.5 * max(self.radius_of(frame.chains[end.chain]) for end in junction.ends)
            at = junction.position[None]
            markers.append(make.marker(number, ADD, "junctions", width, (255, 255, 255), at, SPHERE_LIST))
        yield "/doo3d/markers", types["visualization_msgs/msg/MarkerArray"](markers=markers)


class _MessageFactory:
    """Builder of ROS messages with the same header: `types` maps names such as "nav_msgs/msg/Path" to message classes."""

    def __init__(self, types: Any, header: Any) -> None:
        self.types, self.header = types, header

    def point(self, position: Array) -> Any:
        """Return a geometry_msgs/Point at a position (3,), m."""
        return self.types["geometry_msgs/msg/Point"](*map(float, position))

    def pose(self, position: Array, quaternion: Array) -> Any:
        """Return a geometry_msgs/Pose from a position (3,), m, and a quaternion (4,) in the order x, y, z, w."""
        orientation = self.types["geometry_msgs/msg/Quaternion"](*map(float, quaternion))
        return self.types["geometry_msgs/msg/Pose"](position=self.point(position), orientation=orientation)

    def path(self, chain: Chain) -> Any:
        """Return a nav_msgs/Path with a pose at each joint of a chain.

        The x axis of a pose points along the segment that starts at the joint. At the last joint, where none starts, it points
        along the last segment.
        """
        quaternions = Rotation.from_matrix(link_frames(chain.joints) @ Z_TO_X).as_quat()
        stamped = self.types["geometry_msgs/msg/PoseStamped"]
        poses = [
            stamped(header=self.header, pose=self.pose(joint, quaternion))
            for joint, quaternion in zip(chain.joints, [*quaternions, quaternions[-1]], strict=True)
        ]
        return self.types["nav_msgs/msg/Path"](header=self.header, poses=poses)

    def marker(
        self,
        number: int,
        action: int,
        namespace: str,
        width: float,
        color: tuple[int, int, int],
        points: Floats,
        kind: int = LINE_LIST,
    ) -> Any:
        """Return a visualization_msgs/Marker that draws separate line segments, or spheres.

        Parameters
        ----------
        number
            id of the marker: the number of the chain, or of the junction.
        action
            ADD (0), or DELETE_ALL (3) to clear earlier markers.
        namespace
            namespace of the marker: "seen", "occluded" or "junctions".
        width
            width of the lines or spheres, m.
        color
            (red, green, blue), 0 to 255.
        points
            (2 L, 3) m, the start and the end of each of L line segments; or (L, 3) m, the middles of spheres.
        kind
            LINE_LIST (5) or SPHERE_LIST (7).
        """
        types, zero = self.types, np.zeros(3)
        return types["visualization_msgs/msg/Marker"](
            header=self.header,
            ns=namespace,
            id=number,
            type=kind,
            action=action,
            pose=self.pose(zero, np.array([0, 0, 0, 1])),
            scale=types["geometry_msgs/msg/Vector3"](width, *(2 * (width if kind == SPHERE_LIST else 0.0,))),
            color=types["std_msgs/msg/ColorRGBA"](*(part / 255 for part in color), 1.0),
            lifetime=types["builtin_interfaces/msg/Duration"](sec=0, nanosec=0),
            frame_locked=False,
            points=[self.point(at) for at in points],
            colors=[],
            texture_resource="",
            texture=types["sensor_msgs/msg/CompressedImage"](header=self.header, format="", data=np.zeros(0, dtype=np.uint8)),
            uv_coordinates=[],
            text="",
            mesh_resource="",
            mesh_file=types["visualization_msgs/msg/MeshFile"](filename="", data=np.zeros(0, dtype=np.uint8)),
            mesh_use_embedded_materials=False,
        )
