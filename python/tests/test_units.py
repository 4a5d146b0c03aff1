"""Numbers enter as texts with units or in SI, whatever the door."""

import pickle

import numpy as np
import pytest

import penetrode as pn

SLAB = {
    "projectile": {"mass": "2 kg", "diameter": "50 mm", "nose": {"factor": 0.72}},
    "target": {"strength": "36 MPa", "density": 2300, "thickness": "180 mm"},
    "resistance": {"S": 12.0},
    "impact": {"velocity": np.float64(400.0)},
}


def test_a_scene_is_the_same_from_text_dict_and_keywords():
    keywords = pn.Scene(
        mass=2.0, diameter="50 mm", nose_factor=0.72, strength="36 MPa", density=2300, thickness=0.18, S=12, velocity=400
    )
    text = pn.Scene.from_toml(
        """
        projectile = { mass = "2 kg", diameter = "50 mm", nose = { factor = 0.72 } }
        target = { strength = "36 MPa", density = "2300 kg/m^3", thickness = "180 mm" }
        resistance = { S = 12.0 }
        impact = { velocity = "400 m/s" }
        """
    )
    assert keywords == text == pn.Scene.from_dict(SLAB)
    assert pn.solve(text).depth == pn.solve(keywords).depth


def test_a_plug_by_keywords_is_that_of_the_scene_that_ships():
    plug = {"criterion": "plug", "half_angle": 60, "shear_strength": "7.2 MPa"}
    slab = {"mass": 20, "diameter": "60 mm", "nose": {"shape": "flat"}, "strength": "36 MPa", "density": 2400, "thickness": 0.3}
    flight = pn.solve(pn.Scene(**slab, **plug, velocity=160))
    assert flight.velocity == pn.solve(pn.scene("plug")).velocity and [e.event for e in flight.events][1] == "plug"


def test_a_scene_with_settings_is_another_one():
    scene = pn.Scene.from_dict(SLAB)
    slower = scene.set({"impact.velocity": "350 m/s"}, k=1.5)
    assert (scene.velocity, slower.velocity) == (400.0, 350.0)
    assert slower.to_dict()["k"] == 1.5
    assert slower != scene


def test_a_scene_survives_pickling():
    for name in pn.scene_names():
        scene = pn.scene(name)
        again = pickle.loads(pickle.dumps(scene))
        assert again == scene and pn.solve(again).depth == pn.solve(scene).depth


def test_a_law_of_ones_own_from_a_dict():
    law = {
        "projectile": {"mass": 2.0},
        "parameters": {"P": "848 kN", "b": 0.15, "v1": "50 m/s"},
        "stage": [{"force": "P*(1 + b*log(1 + V/v1))"}],
        "impact": {"velocity": 300},
    }
    assert 0.05 < pn.solve(pn.Scene.from_dict(law)).depth < 0.11


def test_columns_are_understood_in_any_unit():
    si = {"mass_kg": 2.0, "diameter_m": 0.05, "nose_factor": 0.72, "strength_pa": 36e6, "density_kg_m3": 2300.0}
    other = {"mass_g": 2000.0, "diameter_mm": 50.0, "nose_factor": 0.72, "strength_mpa": 36.0, "density_g_cm3": 2.3}
    depths = [pn.batch({**columns, "velocity_m_s": [300.0, 400.0]})["depth_m"] for columns in (si, other)]
    np.testing.assert_allclose(*depths, rtol=1e-15)
    with pytest.raises(pn.TableError, match="mass_s"):
        pn.batch({**si, "mass_s": 1.0, "velocity_m_s": 300.0})
    with pytest.raises(pn.TableError, match="twice"):
        pn.batch({**si, "mass_g": 1.0, "velocity_m_s": 300.0})


def test_states_at_times_and_depths_are_one_flight():
    flight = pn.solve(pn.scene("tunnel"))
    times = np.linspace(0, flight.time, 50)[::-1]
    depth, velocity = flight.at(times)
    assert depth[0] == flight.depth and velocity[-1] == 300.0
    back, speed = flight.at_depth(depth[1:-1])
    np.testing.assert_allclose(back, times[1:-1], rtol=1e-9)
    np.testing.assert_allclose(speed, velocity[1:-1], rtol=1e-6)
    assert np.isnan(flight.at([-1.0, 1.0])[0]).all() and np.isnan(flight.at_depth([-1.0, 9.0])[1]).all()
    np.testing.assert_allclose(flight.trajectory(50)["depth"], depth[::-1], rtol=1e-14)
