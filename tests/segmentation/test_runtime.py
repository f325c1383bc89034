# SPDX-License-Identifier: Apache-2.0
"""One network on all runtimes: several routes to one answer."""

import os
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")
ov = pytest.importorskip("openvino")

from small_networks import FOCAL_PX, random_weights, room, room_input  # noqa: E402

import kintrack  # noqa: E402
from kintrack.geometry import PinholeCamera  # noqa: E402
from kintrack.sequence.frame import Frame  # noqa: E402
from segmentation import runtime  # noqa: E402
from segmentation.architecture import NetworkConfig  # noqa: E402
from segmentation.calibrate import calibrated  # noqa: E402
from segmentation.errors import (  # noqa: E402
    InputError,
    RuntimeFallbackWarning,
    SegmentationError,
    WeightsError,
)
from segmentation.graph import openvino_model, precisions  # noqa: E402
from segmentation.labels import MIRRORED  # noqa: E402
from segmentation.runtime import (  # noqa: E402
    RuntimeConfig,
    labels_of,
    load_segmenter,
    probabilities_of,
    segmenter,
)
from segmentation.weights import save_weights  # noqa: E402

WIDTHS = {
    "fast_fcn": (16, 24, 32, 48),
    "unet": (8, 12, 16, 24, 32),
    "vgg_fcn": (8, 12, 16, 24, 32),
}
EQUAL_LABELS_INT8 = 0.95
"""Least share of pixels on which int8 agrees with float; weights are random, so many are ties."""
EQUAL_LABELS_BF16 = 0.99
UNSEEN = range(10, 14)


@pytest.fixture(scope="module", params=WIDTHS)
def weights(request):
    """Calibrated random weights of each network."""
    config = NetworkConfig(request.param, WIDTHS[request.param])
    return calibrated(random_weights(config), [room_input(seed) for seed in range(8)])


def frame(seed=10, index=0):
    depth, color = room(seed)
    camera = PinholeCamera(512, 424, FOCAL_PX, FOCAL_PX, 256.0, 212.0)
    return Frame(index, 0.0, camera, depth, color)


def logits_on(name, weights, precision="fp32"):
    """Logits of unseen rooms, shape (N, 7, 106, 128)."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        labeller = segmenter(weights, RuntimeConfig(name, precision))
    assert labeller.runtime == name
    return np.stack([labeller.logits_of(room_input(seed)) for seed in UNSEEN])


def share_of_equal_labels(a, b):
    return (a.argmax(1) == b.argmax(1)).mean()


def test_openvino_yields_torchs_logits(weights):
    by_torch, by_openvino = (logits_on(name, weights) for name in ("torch", "openvino"))
    assert np.abs(by_torch - by_openvino).max() < 1e-4 * np.abs(by_torch).max()


def test_int8_yields_nearly_the_same_labels(weights):
    exact, small = (logits_on(name, weights) for name in ("openvino", "openvino-int8"))
    assert len(np.unique(exact.argmax(1))) > 2
    assert not np.array_equal(exact, small)
    assert share_of_equal_labels(exact, small) > EQUAL_LABELS_INT8
    assert np.square(exact - small).mean() < 0.01 * exact.var()


def test_bf16_yields_nearly_the_same_labels(weights):
    exact = logits_on("torch", weights)
    assert share_of_equal_labels(exact, logits_on("torch", weights, "bf16")) > EQUAL_LABELS_BF16
    small = logits_on("openvino", weights, "bf16")
    assert share_of_equal_labels(exact, small) > EQUAL_LABELS_BF16


def test_int8_computes_in_integers_but_for_the_first_convolution(weights):
    core = ov.Core()
    if "INT8" not in core.get_property("CPU", "OPTIMIZATION_CAPABILITIES"):
        pytest.skip("this processor has no integer arithmetic that OpenVINO uses")
    compiled = core.compile_model(openvino_model(weights, quantised=True), "CPU")
    kinds = list(precisions(compiled).values())
    assert kinds[0] not in ("u8", "i8")
    assert len(kinds) > 10 and set(kinds[1:]) <= {"u8", "i8"}


def test_the_float_graph_holds_no_integers(slim):
    properties = {"INFERENCE_PRECISION_HINT": "f32"}
    compiled = ov.Core().compile_model(openvino_model(slim, quantised=False), "CPU", properties)
    assert set(precisions(compiled).values()) == {"f32"}


def test_int8_is_the_choice_where_there_is_no_gpu(slim, monkeypatch):
    monkeypatch.setattr(runtime, "_has_cuda_driver", lambda: False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert segmenter(slim).runtime == "openvino-int8"


def test_a_gpu_is_preferred_where_there_is_one(slim, monkeypatch):
    monkeypatch.setattr(runtime, "_obstacle", lambda name, weights: None)
    monkeypatch.setitem(runtime.RUNTIMES, "torch-cuda", lambda weights, config: None)
    assert segmenter(slim).runtime == "torch-cuda"


def test_a_missing_package_costs_one_warning_and_another_runtime(slim, monkeypatch):
    monkeypatch.setattr(runtime, "_has_cuda_driver", lambda: False)
    monkeypatch.setattr(runtime, "find_spec", lambda name: None if name == "openvino" else name)
    with pytest.warns(RuntimeFallbackWarning, match="openvino is not installed") as told:
        labeller = segmenter(slim)
    assert labeller.runtime == "torch" and len(told) == 1


def test_a_forced_runtime_that_fails_is_replaced_with_one_warning(slim, monkeypatch):
    monkeypatch.setattr(runtime, "_has_cuda_driver", lambda: False)
    words = "openvino-int8 computes the labels, since torch-cuda cannot: there is no CUDA driver"
    with pytest.warns(RuntimeFallbackWarning, match=words) as told:
        labeller = segmenter(slim, RuntimeConfig("torch-cuda"))
    assert labeller.runtime == "openvino-int8" and len(told) == 1


def test_a_runtime_that_breaks_while_starting_is_passed_over(slim, monkeypatch):
    def broken(weights, config):
        raise RuntimeError("unsupported processor")

    monkeypatch.setattr(runtime, "_has_cuda_driver", lambda: False)
    monkeypatch.setitem(runtime.RUNTIMES, "openvino-int8", broken)
    with pytest.warns(RuntimeFallbackWarning, match="does not start: unsupported processor"):
        assert segmenter(slim).runtime == "openvino"


def test_weights_without_ranges_run_in_float_with_a_warning(slim):
    uncalibrated = replace(slim, ranges={})
    with pytest.warns(RuntimeFallbackWarning, match="the weights are not calibrated"):
        labeller = segmenter(uncalibrated, RuntimeConfig("openvino-int8"))
    assert labeller.runtime in ("torch-cuda", "openvino")


def test_no_runtime_at_all_is_an_error_that_names_them(slim, monkeypatch):
    monkeypatch.setattr(runtime, "find_spec", lambda name: None)
    with pytest.raises(SegmentationError, match="openvino is not .*torch is not installed"):
        segmenter(slim)


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ({"runtime": "onnx"}, "'onnx': auto, torch-cuda, openvino-int8, openvino, torch"),
        ({"precision": "fp8"}, "'fp8': auto, fp32, bf16"),
        ({"threads": -1}, "threads = -1"),
    ],
)
def test_an_impossible_choice_is_named_with_the_possible_ones(choice, words):
    with pytest.raises(SegmentationError, match=words):
        RuntimeConfig(**choice)


def test_a_file_becomes_labels_of_a_frame(slim, tmp_path):
    save_weights(tmp_path / "w.safetensors", slim)
    labeller = load_segmenter(tmp_path / "w.safetensors", RuntimeConfig("openvino-int8"))
    labels = labeller.segment(frame())
    assert labels.shape == (106, 128) and labels.dtype == np.uint8 and labels.max() < 7
    assert (labels == labels_of(labeller.logits(frame()))).all()


def test_neither_torch_nor_nncf_is_needed_to_label_in_int8(slim, tmp_path):
    save_weights(tmp_path / "w", slim)
    program = """if True:
        import sys
        sys.modules["torch"] = sys.modules["nncf"] = None
        from pathlib import Path
        import numpy as np
        from segmentation.runtime import RuntimeConfig, load_segmenter
        labeller = load_segmenter(Path(sys.argv[1]), RuntimeConfig("openvino-int8"))
        assert labeller.runtime == "openvino-int8"
        print(labeller.logits_of(np.zeros((4, 106, 128), np.float32)).shape)
    """
    path = os.pathsep.join(str(Path(module.__file__).parents[1]) for module in (runtime, kintrack))
    done = subprocess.run(
        [sys.executable, "-W", "error::UserWarning", "-c", program, str(tmp_path / "w")],
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.strip() == "(7, 106, 128)", done.stderr


def test_a_process_can_still_be_interrupted_after_its_segmenters_are_gone(slim, tmp_path):
    save_weights(tmp_path / "w", slim)
    program = """
import os, signal, sys
from pathlib import Path
from segmentation.runtime import RuntimeConfig, load_segmenter
kept = [load_segmenter(Path(sys.argv[1]), RuntimeConfig("openvino")) for _ in range(2)]
while kept:
    del kept[0]
signal.signal(signal.SIGINT, signal.default_int_handler)
try:
    os.kill(os.getpid(), signal.SIGINT)
except KeyboardInterrupt:
    print("interrupted")
"""
    command = [sys.executable, "-X", "faulthandler", "-c", program, str(tmp_path / "w")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "interrupted", (done.returncode, done.stderr)


def test_a_broken_file_is_no_reason_to_fall_back(tmp_path):
    (tmp_path / "w").write_bytes(b"half")
    with pytest.raises(WeightsError, match="no whole weights file"):
        load_segmenter(tmp_path / "w")


def test_a_later_frame_does_not_overwrite_what_an_earlier_one_gave(slim):
    labeller = segmenter(slim, RuntimeConfig("openvino"))
    first = labeller.logits(frame(10))
    copy = first.copy()
    labeller.logits(frame(11))
    assert (first == copy).all()


@pytest.mark.parametrize("name", ["torch", "openvino", "openvino-int8"])
def test_the_mirror_image_gets_the_mirrored_labels(weights, name):
    labeller = segmenter(weights, RuntimeConfig(name, "fp32"))
    image = room_input(10)
    straight, mirrored = labeller.logits_of(image), labeller.logits_of(image[:, :, ::-1])
    assert np.abs(straight - mirrored[MIRRORED, :, ::-1]).max() < 1e-4 * np.abs(straight).max()
    assert np.abs(straight - mirrored).max() > 0.1 * np.abs(straight).max()


def test_labels_are_the_most_probable_ones():
    logits = np.random.default_rng(0).normal(0, 30, (7, 106, 128)).astype(np.float32)
    p = probabilities_of(logits)
    assert np.allclose(p.sum(axis=0), 1.0, atol=1e-5) and np.isfinite(p).all()
    assert (labels_of(logits) == p.argmax(axis=0)).all()


def test_nan_depth_is_named_with_its_frame(slim):
    depth = frame().depth_m.copy()
    depth[5, 5] = np.nan
    with pytest.raises(InputError, match="frame 3: depth = nan m"):
        segmenter(slim, RuntimeConfig("openvino")).segment(replace(frame(index=3), depth_m=depth))


@pytest.mark.parametrize("shape", [(4, 128, 106), (3, 106, 128), (1, 4, 106, 128)])
def test_an_input_of_a_wrong_size_is_named(slim, shape):
    with pytest.raises(InputError, match=r"\(4, 106, 128\) in float32 is needed"):
        segmenter(slim, RuntimeConfig("openvino")).logits_of(np.zeros(shape, np.float32))
