import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rhot.geometry import transforms as tf

angles = st.floats(-np.pi, np.pi)
vectors = st.tuples(angles, angles, angles).map(np.array)


@given(vectors)
def test_rotation_vector_agrees_with_scipy(vector):
    assert np.allclose(
        tf.rotation_from_vector(vector), Rotation.from_rotvec(vector).as_matrix(), atol=1e-12
    )


@given(vectors)
def test_quaternion_round_trip(vector):
    rotation = tf.rotation_from_vector(vector)
    q = tf.quaternion_from_rotation(rotation)
    assert q[0] >= 0.0
    assert np.isclose(q @ q, 1.0)
    assert np.allclose(tf.rotation_from_quaternion(q), rotation, atol=1e-12)


@pytest.mark.parametrize(
    "axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0.8, 0), (0.6, 0, -0.8), (-0.48, 0.6, 0.64)]
)
def test_quaternion_is_right_at_180_degrees(axis):
    rotation = 2.0 * np.outer(axis, axis) - np.eye(3)
    assert np.allclose(
        tf.rotation_from_quaternion(tf.quaternion_from_rotation(rotation)), rotation, atol=1e-12
    )
    assert np.isclose(np.linalg.norm(tf.vector_from_rotation(rotation)), np.pi)


@given(vectors, vectors)
def test_quaternion_product_is_rotation_product(a, b):
    A, B = tf.rotation_from_vector(a), tf.rotation_from_vector(b)
    product = tf.quaternion_multiply(tf.quaternion_from_rotation(A), tf.quaternion_from_rotation(B))
    assert np.allclose(tf.rotation_from_quaternion(product), A @ B, atol=1e-12)


@given(vectors, vectors)
def test_inverse_and_apply(rotation_vector, position):
    T = tf.transform(tf.rotation_from_vector(rotation_vector), position)
    assert np.allclose(tf.inverse(T) @ T, np.eye(4), atol=1e-12)
    points = np.arange(12.0).reshape(4, 3)
    assert np.allclose(tf.apply(tf.inverse(T), tf.apply(T, points)), points, atol=1e-9)


@given(angles)
def test_angle_between_is_the_angle_turned(angle):
    for axis_rotation in (tf.rotation_x, tf.rotation_y, tf.rotation_z):
        assert np.isclose(
            tf.angle_between(axis_rotation(0.3), axis_rotation(0.3 + angle)), abs(angle), atol=1e-7
        )


@given(vectors, vectors)
def test_skew_is_the_cross_product(a, b):
    assert np.allclose(tf.skew(a) @ b, np.cross(a, b))
