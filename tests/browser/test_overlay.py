"""Chromium plays the videos of `rhot plot --video`, from the beginning to the end."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import pytest

from services.cli.video.webm import WebmWriter

pytestmark = pytest.mark.browser

# Plays a video, then goes to an instant and tells the grey value in the middle of the picture.
PAGE = """
async (source) => {
  const video = document.createElement('video');
  video.muted = true;
  video.src = source;
  const until = name => new Promise((resolve, reject) => {
    video.addEventListener(name, resolve, {once: true});
    video.addEventListener('error', () => reject(video.error.message), {once: true});
  });
  await until('loadedmetadata');
  const ended = until('ended');
  await video.play();
  await ended;
  const found = {duration: video.duration, size: [video.videoWidth, video.videoHeight]};
  const canvas = document.createElement('canvas');
  canvas.width = video.videoWidth;
  canvas.height = video.videoHeight;
  const context = canvas.getContext('2d');
  found.greys = [];
  for (const second of [0.1, 0.5, 0.9]) {
    // Sought is not yet shown.
    const shown = new Promise(resolve => video.requestVideoFrameCallback(resolve));
    video.currentTime = second;
    await shown;
    context.drawImage(video, 0, 0);
    found.greys.push(context.getImageData(32, 24, 1, 1).data[1]);
  }
  return found;
}
"""


def test_chromium_plays_an_overlay(chromium, tmp_path):
    path = tmp_path / "overlay_left.webm"
    with WebmWriter(path, (64, 48), 25.0) as video:
        for number in range(25):
            video.write(np.full((48, 64, 3), 10 * number, np.uint8))
    source = "data:video/webm;base64," + base64.b64encode(path.read_bytes()).decode()
    page = chromium.new_page()
    found: dict[str, Any] = page.evaluate(PAGE, source)
    page.close()
    assert found["duration"] == pytest.approx(1.0, abs=0.05)
    assert found["size"] == [64, 48]
    # Ten grey values a frame: within one frame, and what the codec and the screen leave.
    assert found["greys"] == pytest.approx([25, 125, 225], abs=14)
