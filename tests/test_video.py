"""Videos in every state they come in: each is written here, then read back."""

import struct
import warnings
import wave
from fractions import Fraction

import av
import numpy as np
import pytest
from av.video.reformatter import ColorRange
from memo.video import _LIMITED, VideoDamageWarning, VideoError, VideoReader, _bt601


def read(path, **options):
    with VideoReader(path, **options) as reader:
        return list(reader), reader


def set_display_matrix(path, a, b, c, d):
    """Writes the display matrix of the first track header of an MP4."""
    data = bytearray(path.read_bytes())
    header = data.index(b"tkhd") + 4
    matrix = header + (40 if data[header] == 0 else 52)
    one = 1 << 16
    data[matrix : matrix + 36] = struct.pack(
        ">9i", int(a * one), int(b * one), 0, int(c * one), int(d * one), 0, 0, 0, 1 << 30
    )
    path.write_bytes(data)


def write_pictures(path, pictures, pix_fmt, codec):
    """A lossless video of pictures (N, H, W, 3) in RGB or of the planes that `pix_fmt` has."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=25)
        first = pictures[0]
        stream.width, stream.height, stream.pix_fmt = first.width, first.height, pix_fmt
        for index, picture in enumerate(pictures):
            picture.pts, picture.time_base = index, Fraction(1, 25)
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))


def test_luma_is_the_stored_plane(write_video, luma_frames):
    luma = luma_frames(count=12)
    frames, reader = read(write_video("plain.mp4", luma))
    assert reader.size == (50, 36) and reader.frame_count == 12 and reader.rate_hz == 25
    assert [frame.index for frame in frames] == list(range(12))
    np.testing.assert_allclose([frame.time_s for frame in frames], np.arange(12) / 25, atol=1e-4)
    np.testing.assert_array_equal([frame.luma for frame in frames], luma)
    assert reader.damage is None


def test_colour_video_becomes_bt601_luma(tmp_path):
    rgb = np.random.default_rng(1).integers(0, 256, (24, 40, 3), dtype=np.uint8)
    picture = av.VideoFrame.from_ndarray(rgb, format="rgb24").reformat(format="bgr24")
    write_pictures(tmp_path / "raw.avi", [picture, picture], "bgr24", "rawvideo")
    frames, _ = read(tmp_path / "raw.avi")
    expected = 16 + 219 / 255 * (rgb @ np.array([0.299, 0.587, 0.114]))
    assert np.abs(frames[1].luma - expected).max() <= 1.0


def test_greys_have_the_same_level_in_colour():
    greys = np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 3, axis=2)
    np.testing.assert_array_equal(_bt601(greys)[0], _LIMITED)


@pytest.mark.parametrize("pix_fmt", ["yuv420p10le", "yuyv422", "uyvy422", "nv12", "gray", "yuv444p"])
def test_luma_of_other_layouts(tmp_path, luma_frames, pix_fmt):
    luma = luma_frames(count=1)[0]
    grey = av.VideoFrame.from_ndarray(np.vstack([luma, np.full((18, 50), 128, np.uint8)]), format="yuv420p")
    codec = "ffv1" if pix_fmt == "yuv420p10le" else "rawvideo"
    path = tmp_path / "layout.nut"
    if pix_fmt == "gray":
        grey = av.VideoFrame.from_ndarray(luma, format="gray")
    write_pictures(path, [grey.reformat(format=pix_fmt)], pix_fmt, codec)
    frames, _ = read(path)
    expected = 16 + 219 / 255 * luma if pix_fmt == "gray" else luma
    assert np.abs(frames[0].luma - expected).max() <= 1.0


LAYOUTS = [
    ("full.mp4", "libx264", "yuvj420p"),
    ("full.avi", "mjpeg", "yuvj420p"),
    ("full10.mkv", "ffv1", "yuv420p10le"),
    ("colour.nut", "rawvideo", "bgr24"),
    ("grey.nut", "rawvideo", "gray"),
    ("limited.mp4", "libx264", "yuv420p"),
    ("limited10.mkv", "ffv1", "yuv420p10le"),
]


@pytest.mark.parametrize(("name", "codec", "pix_fmt"), LAYOUTS)
def test_grey_levels_do_not_depend_on_the_range_of_the_video(tmp_path, name, codec, pix_fmt):
    grey = np.repeat(np.arange(0, 256, 5, dtype=np.uint8), 2)[None].repeat(32, axis=0)[:, :96]
    shade = av.VideoFrame.from_ndarray(
        np.ascontiguousarray(grey[:, :, None].repeat(3, axis=2)), format="rgb24"
    )
    is_full = not name.startswith("limited")
    picture = shade.reformat(format=pix_fmt, dst_color_range=ColorRange.JPEG if is_full else ColorRange.MPEG)
    with av.open(str(tmp_path / name), "w") as container:
        stream = container.add_stream(codec, rate=25, options={"qp": "0"} if codec == "libx264" else {})
        stream.width, stream.height, stream.pix_fmt = picture.width, picture.height, pix_fmt
        stream.codec_context.color_range = ColorRange.JPEG if is_full else ColorRange.MPEG
        stream.codec_context.qmin = stream.codec_context.qmax = 1
        picture.pts, picture.time_base = 0, Fraction(1, 25)
        container.mux(stream.encode(picture))
        container.mux(stream.encode(None))
    frames, _ = read(tmp_path / name)
    found = frames[0].luma.astype(float)
    # Black is 16, white is 235 (ITU-R BT.601); JPEG is lossy.
    assert np.abs(found - (16 + 219 / 255 * grey)).mean() <= 1.0, found[0]
    assert abs(found.max() - (16 + 219 / 255 * grey.max())) <= 2.0


@pytest.mark.parametrize(
    ("matrix", "upright"),
    [
        ((1, 0, 0, 1), lambda y: y),
        ((0, 1, -1, 0), lambda y: np.rot90(y, -1)),
        ((-1, 0, 0, -1), lambda y: np.rot90(y, 2)),
        ((0, -1, 1, 0), lambda y: np.rot90(y, 1)),
        ((-1, 0, 0, 1), np.fliplr),
        ((0, 1, 1, 0), np.transpose),
    ],
    ids=["none", "clockwise", "half", "anticlockwise", "mirrored", "transposed"],
)
def test_display_matrix_is_honoured(write_video, luma_frames, matrix, upright):
    luma = luma_frames(count=3)
    path = write_video("phone.mp4", luma)
    set_display_matrix(path, *matrix)
    frames, reader = read(path)
    np.testing.assert_array_equal(frames[2].luma, upright(luma[2]))
    assert reader.size == upright(luma[0]).shape[::-1]


def test_display_matrix_agrees_with_the_library(write_video, luma_frames):
    path = write_video("phone.mp4", luma_frames(count=1))
    set_display_matrix(path, 0, 1, -1, 0)
    with av.open(str(path)) as container:
        assert next(container.decode(video=0)).rotation == -90  # clockwise


def test_other_rotations_are_refused(write_video, luma_frames):
    path = write_video("tilted.mp4", luma_frames(count=1))
    set_display_matrix(path, 0.866, 0.5, -0.5, 0.866)
    with pytest.raises(VideoError, match="quarter turns"):
        VideoReader(path)


def test_variable_rate_keeps_time_stamps(write_video, luma_frames):
    times_s = [0.0, 0.04, 0.12, 0.13, 0.5, 0.9]
    frames, _ = read(write_video("variable.mp4", luma_frames(count=6), times_s=times_s))
    np.testing.assert_allclose([frame.time_s for frame in frames], times_s, atol=1e-4)


def test_time_starts_with_the_first_frame(write_video, luma_frames):
    frames, _ = read(write_video("late.mkv", luma_frames(count=3), times_s=[2.0, 2.5, 3.0]))
    np.testing.assert_allclose([frame.time_s for frame in frames], [0, 0.5, 1.0], atol=2e-3)


def test_missing_time_stamps_follow_the_rate(write_video, luma_frames):
    frames, reader = read(write_video("bare.h264", luma_frames(count=6), options={"bf": "0"}))
    np.testing.assert_allclose([f.time_s for f in frames], np.arange(6) / reader.rate_hz, atol=1e-6)


def test_a_given_rate_replaces_time_stamps(write_video, luma_frames):
    frames, reader = read(write_video("slow.mp4", luma_frames(count=5)), rate_hz=240)
    np.testing.assert_allclose([f.time_s for f in frames], np.arange(5) / 240)
    assert reader.rate_hz == 240


def test_frames_are_chosen_like_a_slice(write_video, luma_frames):
    luma = luma_frames(count=10)
    path = write_video("ten.mp4", luma)
    frames, reader = read(path, start=3, stop=6)
    assert [frame.index for frame in frames] == [3, 4, 5] and reader.frame_count == 3
    np.testing.assert_allclose([frame.time_s for frame in frames], [0.12, 0.16, 0.2], atol=1e-4)
    np.testing.assert_array_equal([frame.luma for frame in frames], luma[3:6])
    with pytest.raises(VideoError, match="frame 10 was requested, but it has 10 frames"):
        read(path, start=10)


@pytest.mark.parametrize("choice", [{"start": -1}, {"start": 4, "stop": 4}, {"rate_hz": 0.0}])
def test_bad_choices_are_refused(write_video, luma_frames, choice):
    with pytest.raises(VideoError):
        VideoReader(write_video("ten.mp4", luma_frames(count=2)), **choice)


def test_shrunk_pictures_are_means_of_whole_blocks(write_video, luma_frames):
    luma = luma_frames(size=(50, 36))
    path = write_video("walk.mp4", luma)
    with VideoReader(path, shrink=3) as reader:
        assert (reader.size, reader.full_size, reader.shrink) == ((16, 12), (50, 36), 3)
        found = [frame.luma for frame in reader]
    blocks = luma[:, :36, :48].reshape(-1, 12, 3, 16, 3)
    np.testing.assert_array_equal(found, np.floor(blocks.mean(axis=(2, 4)) + 0.5))
    set_display_matrix(path, 0, 1, -1, 0)
    with VideoReader(path, shrink=3) as reader:
        assert reader.size == (12, 16)
        assert [frame.luma.shape for frame in reader] == 8 * [(16, 12)]
    with pytest.raises(VideoError, match="36x50 pixels cannot be shrunk by 40"):
        VideoReader(path, shrink=40)


@pytest.mark.parametrize(
    ("size", "shrink"), [((50, 36), 1), ((1280, 32), 1), ((1282, 32), 2), ((32, 3840), 3)]
)
def test_large_pictures_shrink_until_they_are_of_a_size_memo_knows(write_video, luma_frames, size, shrink):
    path = write_video("walk.mp4", luma_frames(count=2, size=size))
    with VideoReader(path, shrink=None) as reader:
        assert reader.shrink == shrink and reader.size == tuple(side // shrink for side in size)


def test_titles_in_any_encoding_do_no_harm(write_video, luma_frames):
    path = write_video("title.mp4", luma_frames(count=2))
    data = path.read_bytes()
    path.write_bytes(data.replace(b"Lavf", b"\xe9t\xe9f"))
    assert data != path.read_bytes() and len(read(path)[0]) == 2


def test_frames_are_read_once(write_video, luma_frames):
    with VideoReader(write_video("once.mp4", luma_frames(count=2))) as reader:
        assert len(list(reader)) == 2
        with pytest.raises(VideoError, match="read once"):
            next(iter(reader))


def test_cut_off_before_its_index_is_not_a_video(write_video, luma_frames):
    path = write_video("cut.mp4", luma_frames(count=30))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(VideoError, match="recording cut off"):
        VideoReader(path)


@pytest.mark.parametrize("name", ["cut.mp4", "cut.mkv"])
def test_cut_off_in_the_middle_gives_what_is_there(write_video, luma_frames, name):
    luma = luma_frames(count=60)
    options = {"options": {"bf": "0"}}
    path = write_video(name, luma, container_options={"movflags": "faststart"}, **options)
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * 0.6)])
    with VideoReader(path) as reader:
        if name.endswith("mp4"):
            with pytest.warns(VideoDamageWarning):
                frames = list(reader)
            assert reader.damage
        else:  # a Matroska file announces nothing, so its end is its end
            frames = list(reader)
    assert 20 < len(frames) < 50
    np.testing.assert_array_equal([frame.luma for frame in frames[:20]], luma[:20])


def test_damage_in_the_middle_is_counted(write_video, luma_frames):
    path = write_video("hurt.mp4", luma_frames(count=60), options={"bf": "0"})
    data = bytearray(path.read_bytes())
    middle = data.index(b"mdat") + len(data) // 2
    data[middle : middle + 3000] = bytes(3000)
    path.write_bytes(data)
    with VideoReader(path) as reader, pytest.warns(VideoDamageWarning, match="could not be decoded"):
        frames = list(reader)
    assert 30 < len(frames) < 60
    assert np.all(np.diff([frame.time_s for frame in frames]) > 0)


@pytest.mark.parametrize(("start", "stop"), [(0, 50), (40, 50)])
def test_damage_is_reported_as_far_as_a_video_was_read(write_video, luma_frames, start, stop):
    path = write_video("hurt.mp4", luma_frames(count=60), options={"bf": "0"})
    data = bytearray(path.read_bytes())
    at = data.index(b"mdat") + len(data) // 6
    data[at : at + 3000] = bytes(3000)
    path.write_bytes(data)
    told = f"could not be decoded; {stop} frames could"
    with VideoReader(path, start=start, stop=stop) as reader, pytest.warns(VideoDamageWarning, match=told):
        assert len(list(reader)) == stop - start


def test_random_damage_is_refused_or_read_around(write_video, luma_frames, tmp_path):
    rng = np.random.default_rng(7)
    whole = write_video("whole.mp4", luma_frames(count=20)).read_bytes()
    path, read_around = tmp_path / "hurt.mp4", 0
    for _ in range(60):
        data = bytearray(whole)
        for place in rng.integers(0, len(data), rng.choice([1, 10, 100])):
            data[place] = rng.integers(256)
        path.write_bytes(data)
        try:
            with warnings.catch_warnings(), VideoReader(path) as reader:
                warnings.simplefilter("ignore", VideoDamageWarning)
                times_s = [frame.time_s for frame in reader]
        except VideoError:
            continue
        assert np.all(np.diff(times_s) > 0)
        read_around += reader.damage is not None
    assert read_around > 5


def test_what_is_not_a_video_is_named(tmp_path):
    empty, text, sound = tmp_path / "empty.mp4", tmp_path / "notes.mp4", tmp_path / "sound.wav"
    empty.touch()
    text.write_text("not a video " * 100)
    with wave.open(str(sound), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(8000)
        file.writeframes(bytes(16000))
    for path, reason in [
        (tmp_path / "absent.mp4", "no such file"),
        (empty, "is empty"),
        (text, "not a video"),
        (sound, "no video stream"),
        (tmp_path, "a folder without images"),
    ]:
        with pytest.raises(VideoError, match=reason) as caught:
            VideoReader(path)
        assert "\n" not in str(caught.value)


def write_image(path, luma, kind="gray", stored="gray"):
    write_pictures(path, [av.VideoFrame.from_ndarray(luma, format=kind)], stored, "png")


@pytest.mark.parametrize(
    ("names", "frames", "absent"),
    [
        (("a_08", "a_09", "a_12", "a_13"), [0, 1, 4, 5], 2),
        (("f0", "f10", "f20", "f40"), [0, 1, 2, 4], 1),
        (("cam2_7", "cam2_8", "cam2_9"), [0, 1, 2], 0),
        # No numbering: other texts, time stamps, and two numbers.
        (("a1", "b2", "c9"), [0, 1, 2], 0),
        (("t1712345", "t1712385", "t1712427", "t1712465"), [0, 1, 2, 3], 0),
        (("a1_1", "a1_2", "a2_1", "a2_9"), [0, 1, 2, 3], 0),
    ],
)
def test_images_that_are_missing_by_their_numbers_take_their_time(
    tmp_path, luma_frames, names, frames, absent
):
    for name, luma in zip(names, luma_frames(count=len(names)), strict=True):
        write_image(tmp_path / f"{name}.png", luma)
    with VideoReader(tmp_path, rate_hz=25.0) as reader, warnings.catch_warnings():
        warnings.simplefilter("ignore", VideoDamageWarning)
        times_s = [frame.time_s for frame in reader]
    np.testing.assert_allclose(times_s, np.array(frames) / 25.0)
    assert (reader.damage is None) == (absent == 0)
    assert absent == 0 or reader.damage.startswith("2 images are" if absent == 2 else "1 image is")


@pytest.mark.parametrize(
    ("stop", "absent"), [(2, None), (3, "1 image is"), (4, "3 images are"), (9, "3 images are")]
)
def test_images_are_missing_as_far_as_a_folder_was_read(tmp_path, luma_frames, stop, absent):
    for index, luma in zip((0, 1, 3, 6, 7, 8), luma_frames(count=6), strict=True):
        write_image(tmp_path / f"f{index}.png", luma)
    with VideoReader(tmp_path, rate_hz=25, stop=stop) as reader, warnings.catch_warnings():
        warnings.simplefilter("ignore", VideoDamageWarning)
        list(reader)
    assert (reader.damage or "None").startswith(f"{absent} missing" if absent else "None")


@pytest.mark.parametrize("kept", [0, 20, 400])
def test_an_image_that_was_cut_off_is_counted_and_keeps_its_place(tmp_path, luma_frames, kept):
    for index, luma in enumerate(luma_frames(count=5)):
        write_image(tmp_path / f"f{index}.png", luma)
    cut = tmp_path / "f2.png"
    cut.write_bytes(cut.read_bytes()[:kept])
    with VideoReader(tmp_path, rate_hz=25) as reader, pytest.warns(VideoDamageWarning, match="1 piece could"):
        times_s = [frame.time_s for frame in reader]
    np.testing.assert_allclose(times_s, np.array([0, 1, 3, 4]) / 25)


@pytest.mark.parametrize(("most", "unused"), [(255, 8), (4095, 4), (65535, 0)])
def test_bits_that_no_pixel_uses_are_counted(tmp_path, most, unused):
    picture = np.linspace(0, most, 64 * 48).astype(np.uint16).reshape(48, 64)
    write_image(tmp_path / "f0.png", picture, "gray16le", "gray16be")
    with VideoReader(tmp_path, rate_hz=25.0) as reader:
        assert reader.unused_bits == unused


def test_a_folder_of_images_in_the_order_of_their_numbers(tmp_path, luma_frames):
    luma = luma_frames(count=11)
    for index in range(11):
        write_image(tmp_path / f"frame{index}.png", luma[index])
    with pytest.raises(VideoError, match="frame rate"):
        VideoReader(tmp_path)
    frames, reader = read(tmp_path, rate_hz=10)
    limited = np.rint(16 + 219 / 255 * luma.astype(float))
    np.testing.assert_array_equal([frame.luma for frame in frames], limited)
    np.testing.assert_allclose([frame.time_s for frame in frames], np.arange(11) / 10)
    assert reader.frame_count == 11


@pytest.mark.parametrize(
    ("names", "series"),
    [
        (("rgb_000.png", "rgb_001.png", "mask_000.png", "mask_001.png"), "mask_*.png and rgb_*.png"),
        (("1_left.png", "1_right.png", "2_left.png", "2_right.png"), "*_left.png and *_right.png"),
        (("f1.bmp", "f1.jpg", "f1.png", "f2.png"), "f*.bmp, f*.jpg and f*.png"),
    ],
)
def test_several_series_of_images_in_a_folder_are_refused(tmp_path, luma_frames, names, series):
    for name, luma in zip(names, luma_frames(count=len(names)), strict=True):
        write_image(tmp_path / name, luma)
    with pytest.raises(VideoError) as refused:
        VideoReader(tmp_path, rate_hz=25)
    assert f"holds several series of images, {series}; give a folder that holds one" in str(refused.value)


@pytest.mark.parametrize(
    "names",
    [
        ("f1.JPG", "f2.JPG", "f3.jpg", "f4.jpg"),  # numbered on
        ("IMG_1.png", "IMG_2_BURST.png", "IMG_3.png"),
        ("first.png", "last.png", "middle.png"),
        ("d1_a1.png", "d1_a2.png", "d2_a1.png", "d2_a2.png"),
    ],
)
def test_a_series_may_have_names_of_any_kind(tmp_path, luma_frames, names):
    luma = luma_frames(count=len(names))
    for name, picture in zip(names, luma, strict=True):
        write_image(tmp_path / name, picture)
    frames, _ = read(tmp_path, rate_hz=25)
    assert len(frames) == len(names)


def test_files_with_a_dot_are_no_images(tmp_path, luma_frames):
    for index, luma in enumerate(luma_frames(count=4)):
        write_image(tmp_path / f"f{index:03}.png", luma)
        (tmp_path / f"._f{index:03}.png").write_bytes(b"\0\5\x16\7\0\2\0\0Mac OS X        ")
    frames, reader = read(tmp_path, rate_hz=25)
    np.testing.assert_allclose([frame.time_s for frame in frames], np.arange(4) / 25)
    assert reader.frame_count == 4 and reader.damage is None


def test_frames_that_change_size_are_refused(tmp_path, luma_frames):
    write_image(tmp_path / "a1.png", luma_frames(count=1)[0])
    write_image(tmp_path / "a2.png", luma_frames(count=1, size=(40, 30))[0])
    with pytest.raises(VideoError, match="frame 1 is 40x30, the previous ones 50x36"):
        read(tmp_path, rate_hz=10)
