"""`doo3d.run` and `doo3d.report` write what the commands write, and their errors name arguments of Python."""

import pytest
from builders.errors import refuses

import doo3d as api


def test_run_writes_what_the_command_writes(capture, doo3d, tmp_path):
    path, seen = capture(frames=2), []
    summary = api.run(path, tmp_path / "python", {"merge.chains": 1}, progress=lambda record: seen.append(record.name))
    assert doo3d("detect", path, "-o", "shell", "--set", "merge.chains=1")[0] == 0
    assert seen == ["000000", "000001"]
    assert str(summary) == "RunSummary(2 frames, 2 chains)"
    for name in ("manifest.json", "config.yaml", "000001.jpg"):
        assert (tmp_path / "python" / name).read_bytes() == (tmp_path / "shell" / name).read_bytes()
    assert api.run(api.open_capture(path), tmp_path / "python", {"merge.chains": 1}).counts() == summary.counts()
    page = api.report(tmp_path / "python")
    assert page == tmp_path / "python.html"
    assert api.report(tmp_path / "python") == page  # its own product, not changed since
    page.write_text("mine")
    with refuses("out-exists", "force=True"):
        api.report(tmp_path / "python")


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        ({"start": "x"}, "selection-invalid", "start x"),
        ({"sequence": True, "fuse_views": True}, "options-conflict", "sequence=True"),
        ({"input_options": {"depth_scale": -1}}, "value-out-of-bounds", "input_options depth_scale"),
    ],
)
def test_errors_speak_of_arguments(capture, tmp_path, arguments, code, told):
    path = capture()
    api.run(path, tmp_path / "out")
    with pytest.raises(api.DooError) as caught:
        api.run(path, tmp_path / "out", **arguments)
    assert caught.value.code == code
    assert told in str(caught.value)
    assert "--" not in str(caught.value)
