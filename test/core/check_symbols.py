#!/usr/bin/python3
"""No symbol that a plain program could link may have been compiled for wide registers.

Inline functions and templates are weak symbols: of all copies the linker keeps one. If a copy compiled for AVX-512 has
the name of one compiled for any x86, a processor without AVX-512 may be given it. So in the objects compiled for an
instruction set every weak function must have that set in its name. Usage: check_symbols.py OBJECT...
"""
import re
import subprocess
import sys

SETS = {'sse2': r'xsimd::sse2', 'avx2': r'xsimd::fma3<xsimd::avx2>', 'avx512': r'xsimd::avx512f'}

objects = [o for o in sys.argv[1:] if re.search(r'_(%s)\.cpp\.o$' % '|'.join(SETS), o)]
if len(objects) % len(SETS) != 0 or len(objects) < 4 * len(SETS):
    sys.exit('expected at least four objects for each of %s, found %s' % (', '.join(SETS), objects))
weak, wrong = 0, []
for path in objects:
    name = re.search(r'_(\w+?)\.cpp\.o$', path.replace('_kernels', '').replace('loops_', '_').replace('kernels_', '_'))[1]
    for line in subprocess.run(['nm', '-C', path], check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines():
        kind, symbol = line[17:18], line[19:]
        if kind != 'W':  # V and u are data
            continue
        weak += 1
        if not re.search(SETS[name], symbol):
            wrong.append('%s: %s' % (path, symbol))
if weak == 0:
    sys.exit('nothing was looked at')
if wrong:
    sys.exit('weak symbols without their instruction set in the name:\n' + '\n'.join(wrong))
print('%d weak symbols in %d objects, each with its instruction set in its name' % (weak, len(objects)))
