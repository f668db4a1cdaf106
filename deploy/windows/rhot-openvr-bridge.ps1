# Runs rhot-openvr-bridge on a Windows computer with SteamVR, for as long as its window is open.
#
#   powershell -ExecutionPolicy Bypass -File rhot-openvr-bridge.ps1 -Config rig.toml -Name steamvr
#
# The first run makes a virtual environment beside this script and installs rhot's wheel into it,
# the later ones start at once. -Wheel is the wheel (or a folder of wheels, for a computer without
# internet); it is installed again when it changes. -Name is the certificate's name in [bus]
# object_sources. It needs 64-bit Python 3.13 or newer: before, Windows' clock stepped by 15.6 ms.
# docs/guide/steamvr.md goes through it step by step.
param(
    [string]$Config = "rig.toml",
    [string]$Name = "main",
    [string]$Wheel = "",
    [string]$Python = "py"
)
$ErrorActionPreference = "Stop"
$here = Split-Path -Parent $MyInvocation.MyCommand.Path
$environment = Join-Path $here "rhot-environment"
$executable = Join-Path $environment "Scripts\python.exe"
$installed = Join-Path $environment "installed.txt"

function Fail([string]$text) {
    Write-Host "rhot-openvr-bridge.ps1: error: $text" -ForegroundColor Red
    exit 2
}

function Find-Wheel {
    $place = if ($Wheel) { $Wheel } else { $here }
    if (-not (Test-Path $place)) { Fail "-Wheel ${place}: there is no such file or folder" }
    $found = Get-ChildItem -Path $place -Filter "rhot-*.whl" | Sort-Object LastWriteTime | Select-Object -Last 1
    if (-not $found) { Fail "there is no wheel of rhot (rhot-*.whl) in $place; name it with -Wheel" }
    return $found
}

function Install-Rhot {
    $file = Find-Wheel
    $digest = (Get-FileHash $file.FullName).Hash
    if ((Test-Path $installed) -and ((Get-Content $installed -TotalCount 1) -eq $digest)) { return }
    if (-not (Test-Path $executable)) {
        Write-Host "making a virtual environment in $environment"
        & $Python -m venv $environment
        if ($LASTEXITCODE -ne 0) { Fail "Python could not make it; install 64-bit Python 3.13 or newer from python.org" }
    }
    & $executable -c "import struct, sys; sys.exit(sys.version_info < (3, 13) or struct.calcsize('P') != 8)"
    if ($LASTEXITCODE -ne 0) { Fail "this Python is too old, or not 64-bit: install 64-bit Python 3.13 or newer, remove $environment and run this again" }
    $options = @()
    # Beside other wheels, everything comes from that folder.
    if (@(Get-ChildItem -Path $file.DirectoryName -Filter "*.whl").Count -gt 1) {
        $options = @("--no-index", "--find-links", $file.DirectoryName)
    }
    Write-Host "installing $($file.Name)"
    & $executable -m pip install --quiet --disable-pip-version-check @options "$($file.FullName)[openvr]"
    if ($LASTEXITCODE -ne 0) { Fail "pip could not install rhot (see above)" }
    # The same version may have been built anew.
    & $executable -m pip install --quiet --disable-pip-version-check --no-index --no-deps --force-reinstall $file.FullName
    if ($LASTEXITCODE -ne 0) { Fail "pip could not install rhot (see above)" }
    Set-Content -Path $installed -Value $digest
}

if (-not (Test-Path $Config)) { Fail "-Config ${Config}: there is no such file; copy the master's rig.toml here" }
Install-Rhot
while ($true) {
    & $executable -m services.openvr_bridge --config $Config --instance $Name
    # 0: ended by Ctrl-C. 75: it wants to be started again. Else it failed, and has said why.
    if ($LASTEXITCODE -eq 0) { break }
    if ($LASTEXITCODE -ne 75) {
        Write-Host "the bridge ended with code $LASTEXITCODE; it starts again in 5 seconds, Ctrl-C ends it"
        Start-Sleep -Seconds 5
    }
}
