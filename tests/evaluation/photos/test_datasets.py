"""The readers of the public photographs, on small ones in the same layouts."""

import cv2
import numpy as np
import pytest
from builders.errors import refuses
from builders.paths import DATA
from builders.photos import COLORS, cross, labelled, painted, save

from doo3d.errors import ConfigError
from doo3d.evaluation.photos.datasets import CSET_SIZE, MIN_CABLE_PIXELS, cset, hsv_mask, mbest

LABELS = labelled(cross())
WIDE = cv2.resize(LABELS, CSET_SIZE, interpolation=cv2.INTER_NEAREST)


def mbest_folder(root, images=("img10", "img2"), subsets=("S1", "S2")):
    for subset in subsets:
        for name in images:
            save(root / subset / "images" / f"{name}.jpg", painted(LABELS))
            save(root / subset / "labels" / f"{name}.png", LABELS)
    return root


def cset_folder(root, names=("images", "labels", "masks"), labels=WIDE, name="c2_4"):
    save(root / names[0] / f"{name}.png", painted(labels))
    opaque = np.dstack((painted(labels)[:, :, ::-1], np.full(labels.shape, 255, np.uint8)))
    (root / names[1]).mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(root / names[1] / f"{name}.png"), opaque)
    save(root / names[2] / f"{name}.png", np.where(WIDE == 1, 128, 127).astype(np.uint8))
    return root


def test_mbest_gives_images_labels_and_their_foreground(tmp_path):
    refs = mbest(mbest_folder(tmp_path))
    assert [(ref.family, ref.name) for ref in refs] == [("S1", "img2"), ("S1", "img10"), ("S2", "img2"), ("S2", "img10")]
    photo = refs[0].load()
    assert photo.image.shape == (*LABELS.shape, 3)
    assert (photo.labels == LABELS).all()
    assert (photo.mask == (LABELS > 0)).all()
    assert photo.cables == 2
    assert photo.image[75, 40].tolist() == pytest.approx(COLORS[0], abs=25)  # RGB, not BGR; JPEG


def test_mbest_reads_the_public_repository(tmp_path):
    for name in ("img0", "img1"):
        save(tmp_path / "dataset/S3/images" / f"{name}.jpg", painted(LABELS))
        save(tmp_path / "dataset/S3/gt_images" / f"{name}.png", painted(LABELS))
        (tmp_path / "dataset/S3/gt_labels").mkdir(exist_ok=True)
        np.save(tmp_path / "dataset/S3/gt_labels" / f"{name}.npy", LABELS * 3)
    for root in (tmp_path, tmp_path / "dataset", tmp_path / "dataset/S3"):
        refs = mbest(root)
        assert [(ref.family, ref.name) for ref in refs] == [("S3", "img0"), ("S3", "img1")]
        assert (refs[1].load().labels == LABELS).all()


def test_subsets_are_chosen_and_others_refused(tmp_path):
    folder = mbest_folder(tmp_path)
    assert {ref.family for ref in mbest(folder, subsets=["s2"])} == {"S2"}
    with refuses("subset-unknown", "S7", "S1, S2"):
        mbest(folder, subsets=["S7"])


def test_what_is_not_there_is_named(tmp_path):
    with refuses("photos-missing"):
        mbest(tmp_path)
    folder = mbest_folder(tmp_path)
    (folder / "S1/labels/img2.png").unlink()
    with refuses("label-missing", "img2.jpg", "img2.png"):
        mbest(folder)
    with refuses("choice-unknown", "network", "labels, hsv", kind=ConfigError):
        mbest(folder, "network")


def test_labels_of_another_size_or_kind_are_refused(tmp_path):
    folder = mbest_folder(tmp_path, images=("img0",), subsets=("S1",))
    save(folder / "S1/labels/img0.png", LABELS[:-1])
    with refuses("label-size", "img0.png", "200x149"):
        mbest(folder)[0].load()
    save(folder / "S1/labels/img0.png", painted(LABELS))
    with refuses("label-shape", "img0.png"):
        mbest(folder)[0].load()
    (folder / "S1/labels/img0.png").write_bytes(b"no image")
    with refuses("image-unreadable", "img0.png"):
        mbest(folder)[0].load()


def test_hsv_mask_takes_the_cables_colors_and_drops_specks(tmp_path):
    image = np.full((60, 60, 3), 10, np.uint8)
    for row, color in ((5, (230, 90, 120)), (20, (120, 200, 60)), (35, (40, 150, 150))):
        image[row : row + 8, 5:55] = color
    image[55, 30] = (230, 90, 120)  # a speck
    wanted = np.zeros((60, 60), dtype=bool)
    for row in (5, 20, 35):
        wanted[row : row + 8, 5:55] = True
    assert (hsv_mask(image) == wanted).all()
    save(tmp_path / "S1/images/img0.png", image)
    save(tmp_path / "S1/labels/img0.png", wanted.astype(np.uint8))
    image[:, 25:35] = 10  # the mask is made from the image, not from the labels
    save(tmp_path / "S1/images/img0.png", image)
    assert not mbest(tmp_path, "hsv")[0].load().mask[8, 30]


@pytest.mark.parametrize(
    ("below", "names"), [("", ("images", "labels", "masks")), ("data", ("test_imgs", "test_labels", "test_masks"))]
)
def test_cset_numbers_the_colors(tmp_path, below, names):
    cset_folder(tmp_path / below, names)
    (ref,) = cset(tmp_path)
    photo = ref.load()
    assert (ref.family, ref.name, photo.cables) == ("C2", "c2_4", 2)
    assert photo.image.shape == (360, 640, 3)
    assert (photo.mask == (WIDE > 0)).all()
    for number in (1, 2):
        assert len(np.unique(photo.labels[number == WIDE])) == 1
    assert (cset(tmp_path, "network")[0].load().mask == (WIDE == 1)).all()


def test_cset_is_scaled_to_one_size_and_specks_are_no_cables(tmp_path):
    short = WIDE[:, :-1].copy()
    short[0, : MIN_CABLE_PIXELS // 2] = 3
    cset_folder(tmp_path, labels=short)
    photo = cset(tmp_path)[0].load()
    assert photo.labels.shape == photo.mask.shape == photo.image.shape[:2] == (360, 640)
    assert photo.cables == 2
    assert not photo.mask[0].any()
    cset_folder(tmp_path, labels=np.where(np.arange(640) < MIN_CABLE_PIXELS, np.uint8(3), WIDE))
    assert cset(tmp_path)[0].load().cables == 3


def test_cset_without_the_networks_masks(tmp_path):
    folder = cset_folder(tmp_path)
    (folder / "masks/c2_4.png").unlink()
    assert len(cset(folder)) == 1
    with refuses("label-missing", "masks/"):
        cset(folder, "network")


@pytest.mark.skipif(not DATA.is_dir(), reason="the public photographs are not beside the checkout")
def test_the_public_photographs_are_as_they_are_said_to_be():
    for ref in mbest(DATA / "mbest")[::40]:
        photo = ref.load()
        assert photo.cables == int(ref.family[1])
        assert photo.labels.shape == (896, 672)
    for ref in cset(DATA / "cset", "network")[::20]:
        photo = ref.load()
        assert 2 <= photo.cables <= 6
        assert (photo.mask & (photo.labels > 0)).sum() > 0.5 * (photo.labels > 0).sum()
