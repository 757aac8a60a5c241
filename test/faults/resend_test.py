# SPDX-License-Identifier: Apache-2.0
"""Row B6: whoever asks the front end to send clouds again gets each once, and keyframes no faster than by asking."""

from pathlib import Path

import ignis_lcm.ignis as types

from fault_drive import FaultRun


def request(session: int, ids: list[int]) -> bytes:
    message = types.keyframe_request_t()
    message.session, message.sender, message.ids, message.num_ids = session, "a test", ids, len(ids)
    return message.encode()


def test_fault_b6_asking_for_clouds_is_no_way_around_the_limit_on_keyframes(drive_log: Path, tmp_path: Path) -> None:
    clouds: dict[int, types.cloud_t] = {}  # by stamp
    again: list[types.cloud_t] = []
    keyframes: list[types.keyframe_t] = []
    with FaultRun(tmp_path, ("lio_frontend",)) as run:

        def keep_cloud(_: str, data: bytes) -> None:
            cloud = types.cloud_t.decode(data)
            clouds[cloud.utime] = cloud

        run.bus.subscribe("LIO_CLOUD", keep_cloud).set_queue_capacity(1000)
        run.bus.subscribe("LIO_CLOUD_AGAIN", lambda _, data: again.append(types.cloud_t.decode(data)))
        run.bus.subscribe("LIO_KEYFRAME", lambda _, data: keyframes.append(types.keyframe_t.decode(data)))
        run.play(drive_log)
        newest = keyframes[-1]
        cloud = clouds[newest.utime]

        def resent(body: bytes) -> tuple[int, int]:
            """Parts of keyframes and of clouds in the answer."""
            again.clear()
            keyframes.clear()
            run.send("CLOUD_REQUEST", body)
            run.listen(1.0)
            return len(keyframes), len(again)

        once = resent(request(cloud.session, [cloud.sequence]))
        assert once == (newest.part_count, cloud.part_count)
        assert resent(request(cloud.session, [cloud.sequence] * 24)) == once, "doubled numbers are answered once"

        # Requests for keyframes use up what may be sent again; clouds that bring a keyframe with them wait as well.
        for _ in range(40):
            run.send("KEYFRAME_REQUEST", request(newest.session, list(run.seen.keyframes)))
            run.send("KEYFRAME_REQUEST", request(newest.session, list(run.seen.keyframes)))
            run.send("CLOUD_REQUEST", request(cloud.session, [cloud.sequence]))
        run.listen(2.5)
        assert run.seen.rejected("lio_frontend", "KEYFRAME_REQUEST") > 0
        assert run.seen.rejected("lio_frontend", "CLOUD_REQUEST") > 0, "40 answers alone would have been sent"
