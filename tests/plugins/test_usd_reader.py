import small_shots as shots
from calmotion.model.run import Source
from calmotion.testing import host_with, run_operator


def read(repository, path, command="optimize"):
    host = host_with(repository / "plugins" / "usd_reader")
    return run_operator(host, "usd.read", [Source(path=str(path), command=command)])


def test_operator_gives_character_animation_and_provenance(repository, tmp_path):
    shot = shots.write_arm(tmp_path / "shot.usda")
    character, animation, provenance = read(repository, shot)
    assert [motor.path for motor in character.motors] == [shots.SHOULDER, shots.ELBOW]
    assert len(animation.frame_times) == shots.FRAMES + 1 and animation.current is animation.tracks
    assert provenance.shot == str(shot) and provenance.time_codes_per_second == shots.RATE


def test_real_shots_are_read_with_their_motors(repository, shared_data):
    for name, bodies, motors in (("g1_dual_arm_hands_chop", 14, 14), ("g1_dual_arm_disco", 14, 14)):
        character, animation, _ = read(repository, shared_data / "shots" / f"{name}.usda")
        assert (len(character.bodies), len(character.motors)) == (bodies, motors)
        assert animation.frame_times[-1] > 7.9


def test_a_real_shot_with_closed_chains_is_read_completely(repository, shared_data):
    character, _, _ = read(repository, shared_data / "shots" / "dr_legs_walk.usda")
    assert len(character.motors) == 12
    assert sum(joint.kind == "revolute" for joint in character.joints) == 36
