import numpy as np
import pytest
from builders.chains import RADIUS, capture, helix
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

import doo3d


def read(path):
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as bag:
        return [(c.topic, c.msgtype, stamp, bag.deserialize(raw, c.msgtype)) for c, stamp, raw in bag.messages()]


def xyz(point):
    return [point.x, point.y, point.z]


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_path_per_chain_and_markers_per_frame(tmp_path, storage):
    frames = capture()
    found = read(doo3d.export(frames, "ros2", tmp_path / "bag", storage=storage)[0])
    stamps = [round(frame.timestamp * 1e9) for frame in frames]
    paths = [(topic, stamp, message) for topic, kind, stamp, message in found if kind == "nav_msgs/msg/Path"]
    assert {(topic, stamp) for topic, stamp, _ in paths} == {
        ("/doo3d/chain0", stamps[0]),
        ("/doo3d/chain3", stamps[0]),
        ("/doo3d/chain0", stamps[2]),
    }
    for topic, stamp, message in paths:
        chain = next(c for c in frames[stamps.index(stamp)].chains if topic == f"/doo3d/chain{c.id}")
        assert (message.header.stamp.sec * 10**9 + message.header.stamp.nanosec, message.header.frame_id) == (stamp, "camera")
        np.testing.assert_array_equal([xyz(pose.pose.position) for pose in message.poses], chain.joints)
        turns = [[q.x, q.y, q.z, q.w] for q in (pose.pose.orientation for pose in message.poses)]
        ahead = Rotation.from_quat(turns[:-1]).apply([1, 0, 0])
        np.testing.assert_allclose(ahead * chain.segment_length, np.diff(chain.joints, axis=0), atol=1e-12)
    arrays = [(stamp, message.markers) for topic, _, stamp, message in found if topic == "/doo3d/markers"]
    assert [stamp for stamp, _ in arrays] == stamps
    for (_, markers), frame in zip(arrays, frames, strict=True):
        assert markers[0].action == 3  # what was shown before goes
        assert len(markers) == 1 + 2 * len(frame.chains)
        for marker in markers[1:]:
            chain = next(chain for chain in frame.chains if chain.id == marker.id)
            pairs = np.array([xyz(point) for point in marker.points]).reshape(-1, 2, 3)
            chosen = chain.occluded == (marker.ns == "occluded")
            np.testing.assert_array_equal(pairs, np.stack((chain.joints[:-1], chain.joints[1:]), axis=1)[chosen])
            assert marker.scale.x == 2 * RADIUS


def test_without_stamps_and_in_the_world(tmp_path):
    frames = [doo3d.Detection((helix(),), frame=str(i), coordinates="world") for i in range(3)]
    found = read(doo3d.export(frames, "ros2", tmp_path / "bag", rate=10)[0])
    assert sorted({stamp for _, _, stamp, _ in found}) == [0, 10**8, 2 * 10**8]
    assert {message.header.frame_id for topic, _, _, message in found if topic == "/doo3d/chain0"} == {"map"}
