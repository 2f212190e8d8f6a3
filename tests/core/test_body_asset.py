import torch

from omomo_core.body.model import load_body
from omomo_core.skeleton import ALL_JOINTS, PALM_JOINTS, joint

BODY = load_body()
FLIP = torch.tensor([-1.0, 1.0, 1.0])


def at(name: str) -> torch.Tensor:
    return BODY.rest_joints[joint(name)]


def test_it_is_an_adult_standing_on_the_floor():
    assert abs(BODY.height - 1.72) < 1e-3
    soles = BODY.vertices[BODY.vertices[:, 1] < 0.03]
    left, right = soles[soles[:, 0] > 0], soles[soles[:, 0] < 0]
    assert abs(float(left[:, 1].min() - right[:, 1].min())) < 1e-4
    for foot in (left, right):  # heel and toes are both on the floor
        heel, toes = foot[foot[:, 2] < 0], foot[foot[:, 2] > 0.15]
        assert heel[:, 1].min() < 0.01
        assert toes[:, 1].min() < 0.01


def test_left_and_right_mirror_each_other():
    for name in ALL_JOINTS:
        if name.startswith("left"):
            right = at(name.replace("left", "right"))
            torch.testing.assert_close(at(name) * FLIP, right, atol=1e-6, rtol=0)
        elif not name.startswith("right"):
            assert abs(float(at(name)[0])) < 1e-6
    exact = "donot_use_mm_for_euclid_dist"
    apart = torch.cdist(BODY.vertices[::20] * FLIP, BODY.vertices, compute_mode=exact)
    assert apart.min(dim=1).values.max() < 1e-4


def test_it_faces_plus_z_with_its_left_at_plus_x():
    assert at("left_wrist")[0] > 0.5
    assert at("left_foot")[2] - at("left_ankle")[2] > 0.1
    head = BODY.vertices[BODY.vertices[:, 1] > at("head")[1] - 0.02]
    nose = head[head[:, 2].argmax()]
    assert abs(float(nose[0])) < 0.01


def test_it_stands_in_a_t_pose_with_palms_down():
    for part in ("elbow", "wrist", "middle1"):
        torch.testing.assert_close(
            at(f"left_{part}")[1:], at("left_shoulder")[1:], atol=1e-3, rtol=0
        )
    for part in ("knee", "ankle"):
        torch.testing.assert_close(at(f"left_{part}")[::2], at("left_hip")[::2], atol=1e-3, rtol=0)
    index, pinky = at("left_index1"), at("left_pinky1")
    assert index[2] > pinky[2] + 0.04  # thumb side forward
    assert abs(float(index[1] - pinky[1])) < 1e-3
    assert at("left_thumb3")[1] < at("left_wrist")[1]


def test_skin_weights_are_a_blend_of_near_bones():
    assert BODY.skin_weights.min() >= 0
    torch.testing.assert_close(BODY.skin_weights.sum(dim=1), torch.ones(len(BODY.vertices)))
    assert set(BODY.skin_joints[:, 0].tolist()) >= {joint(n) for n in ("head", "left_thumb3")}
    main = BODY.rest_joints[BODY.skin_joints[:, 0]]
    assert (BODY.vertices - main).norm(dim=1).max() < 0.5
    left = BODY.vertices[:, 0] > 0.25
    names = {ALL_JOINTS[j] for j in BODY.skin_joints[left, 0].tolist()}
    assert all(name.startswith("left") for name in names)


def test_relaxed_fingers_curl_toward_the_palm():
    eye = torch.eye(3).expand(30, 3, 3)
    torch.testing.assert_close(
        BODY.relaxed_fingers @ BODY.relaxed_fingers.mT, eye, atol=1e-5, rtol=0
    )
    middle = PALM_JOINTS[0] - 22
    tip = torch.tensor([1.0, 0.0, 0.0])
    for j in (middle, middle + 1, middle + 2):
        tip = BODY.relaxed_fingers[j] @ tip
        assert tip[1] < 0
        tip = torch.tensor([1.0, 0.0, 0.0])


def test_the_credit_travels_with_the_body():
    assert "CC0" in BODY.credit
    assert "MakeHuman" in BODY.credit
