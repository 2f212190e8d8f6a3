"""Choice of bfloat16: on GPUs, and on processors that have units for it."""

import torch


def quick_in_bf16(device: torch.device) -> bool:
    """Whether matrix products in bfloat16 take less time than in single precision.

    A processor without such units emulates them, 20 times as slowly.
    """
    if device.type == "cuda":
        return torch.cuda.is_bf16_supported(including_emulation=False)
    if device.type != "cpu":
        return True
    able = torch.cpu.get_capabilities()
    return bool(able.get("amx_bf16") or able.get("avx512_bf16"))
